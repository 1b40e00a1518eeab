#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Geometry builder, per level of the wide tree, 2 of 2: queues the inner children, and leaves for the next level's passes where
// it begins and how many it has.
#include "build/blas_choice.glsl"

layout(local_size_x = 64) in;

shared uint sums[64];

void queue_children(uint index, uint next) {
  offsets[index] = next;
  const Choice choice = choose_children(queue[index].x);
  uint first = queue[index].y;
  for (uint k = 0u; k < choice.count; ++k) {
    const uint child = choice.child[k];
    if ((choice.inner >> k & 1u) != 0u) queue[next++] = uvec2(child, first);
    first += triangles_below(child);
  }
}

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint level = blas_levels + args.level * blas_level_words;
  const uint level_first = state[level + blas_level_first];
  const uint level_count = state[level + blas_level_count];
  // What the workgroups before this one have.
  uint before = 0u;
  for (uint group = lane; group < gl_WorkGroupID.x; group += 64u) before += offsets[group_sum_place(group)];
  sums[lane] = before;
  for (uint step = 32u; step >= 1u; step /= 2u) {
    barrier();
    if (lane < step) sums[lane] += sums[lane + step];
  }
  barrier();
  before = sums[0];
  const uint i = gl_GlobalInvocationID.x;
  const uint next_level = level_first + level_count;
  if (i < level_count) queue_children(level_first + i, next_level + before + offsets[level_first + i]);
  if (lane == 0u && gl_WorkGroupID.x == gl_NumWorkGroups.x - 1u) {
    const uint count = before + offsets[group_sum_place(gl_WorkGroupID.x)];
    const uint next = level + blas_level_words;
    state[next + blas_level_groups] = (count + 63u) / 64u;
    state[next + blas_level_groups + 1u] = state[next + blas_level_groups + 2u] = 1u;
    state[next + blas_level_first] = next_level;
    state[next + blas_level_count] = count;
  }
}
