#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// One level of the collapse, 1 of 2: how many inner children each wide node of the level has. The scan after it gives
// every one its place in the next level, the same in every run.
#include "build/phase_collapse.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.level_count) return;
  const uvec2 entry = queue[args.queue_half * args.half_size + i];
  offsets[i] = inner_children(choose_children(entry.x));
}
