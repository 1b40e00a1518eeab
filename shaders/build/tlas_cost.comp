#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The cost of a search through a TLAS by the surface area heuristic, estimated from its upper nodes: the sum
// of their surfaces over the root's. One workgroup sums in a fixed order.
#include "common/bounds.glsl"
#include "shared/build.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RefitArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer MotionBoxesBuffer { MotionBox motion_boxes[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer CostBuffer { float cost; };

shared float sums[64];

float surface(uint node) {
  const MotionBox box = motion_boxes[args.node_boxes + node];
  return box_half_area(box.begin) + box_half_area(args.still != 0u ? box.begin : box.end);
}

void main() {
  const uint lane = gl_LocalInvocationID.x;
  float sum = 0.0;
  for (uint node = lane; node < args.count; node += 64u) sum += surface(node);
  sums[lane] = sum;
  barrier();
  if (lane != 0u || args.count == 0u) return;
  for (uint k = 1u; k < 64u; ++k) sum += sums[k];
  cost = sum / max(surface(0u), 1e-30);
}
