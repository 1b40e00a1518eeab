#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// One level of a TLAS's refit.
#include "common/bounds.glsl"
#include "shared/build.h"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RefitArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer MotionBoxesBuffer { MotionBox motion_boxes[]; };
layout(set = 0, binding = 1, scalar) buffer NodeBoxesBuffer { MotionBox node_boxes[]; };
layout(set = 0, binding = 2, scalar) buffer WideBuffer { uvec4 wide[]; };
#include "build/phase_refit.glsl"

void main() {
  if (gl_GlobalInvocationID.x < args.count) refit_node(args.first + gl_GlobalInvocationID.x);
}
