#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Recomputes the boxes of the nodes above a few changed instances, in one workgroup. It proceeds level by
// level from the deepest, since the nodes of a level follow those of the level above. Where several paths
// meet, one continues.
#include "common/bounds.glsl"
#include "shared/build.h"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { PatchArgs args; };
layout(set = 0, binding = 0, scalar) coherent buffer MotionBoxesBuffer { MotionBox motion_boxes[]; };
layout(set = 0, binding = 1, scalar) coherent buffer WideBuffer { uvec4 wide[]; };
layout(set = 0, binding = 2, scalar) readonly buffer ParentsBuffer { uint parents[]; };
// Per node: the stamp of the last patch that visited it.
layout(set = 0, binding = 3, scalar) coherent buffer StampsBuffer { uint stamps[]; };
// The next node on the path of each listed instance.
layout(set = 0, binding = 4, scalar) buffer ClimbersBuffer { uint climbers[]; };
layout(set = 0, binding = 5, scalar) readonly buffer PlacesBuffer { uint listed_places[]; };
// The first node of each level.
layout(set = 0, binding = 6, scalar) readonly buffer LevelsBuffer { uint levels[]; };
#include "build/phase_refit.glsl"

const uint no_node = 0xFFFFFFFFu;

void main() {
  const uint lane = gl_LocalInvocationID.x;
  for (uint i = lane; i < args.count; i += 64u) {
    const uint place = listed_places[i];
    climbers[i] = place < args.visible_count ? parents[args.leaf_parents + place] : no_node;
  }
  for (uint level = args.levels; level > 0u; --level) {
    const uint first = levels[level - 1u];
    for (uint i = lane; i < args.count; i += 64u) {
      const uint node = climbers[i];
      if (node == no_node || node < first) continue;
      uint next = no_node;
      if (atomicExchange(stamps[node], args.stamp) != args.stamp) {
        refit_node(node);
        next = node == 0u ? no_node : parents[node];
      }
      climbers[i] = next;
    }
    memoryBarrierBuffer();
    barrier();
  }
}
