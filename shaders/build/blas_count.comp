#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Geometry builder, per level of the wide tree, 1 of 2: how many inner children the wide nodes of the level have, and where
// those of each stand among those of its workgroup.
#include "build/blas_choice.glsl"

layout(local_size_x = 64) in;

shared uint counts[64];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint level = blas_levels + args.level * blas_level_words;
  const uint i = gl_GlobalInvocationID.x;
  const bool mine = i < state[level + blas_level_count];
  const uint index = state[level + blas_level_first] + i;
  counts[lane] = mine ? uint(bitCount(choose_children(queue[index].x).inner)) : 0u;
  barrier();
  if (lane == 0u) {
    uint sum = 0u;
    for (uint k = 0u; k < 64u; ++k) {
      const uint here = counts[k];
      counts[k] = sum;
      sum += here;
    }
    offsets[group_sum_place(gl_WorkGroupID.x)] = sum;
  }
  barrier();
  if (mine) offsets[index] = counts[lane];
}
