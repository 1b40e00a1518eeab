#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, per level of the wide tree, step 2 of 2: queues the inner children, and records where the
// next level begins and its size for the passes of that level. For a TLAS it also writes the nodes.
#include "build/tree_choice.glsl"
#ifdef BUILD_TLAS
#include "build/tlas_node.glsl"
#endif

layout(local_size_x = 64) in;

shared uint sums[64];

void queue_children(uint index, uint before) {
  const uvec4 entry = queue[index];
  const uvec4 low = children[2u * index];
  const uvec4 high = children[2u * index + 1u];
  const uint child[8] = uint[8](low.x, low.y, low.z, low.w, high.x, high.y, high.z, high.w);
  uint next = before + entry.w;
#ifdef BUILD_TLAS
  const uint count = entry.z >> 8;
  Box box[8];
  uint reference[8];
  uint inner_reference = next;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const bool inner = (entry.z >> k & 1u) != 0u;
    const uint here = k < count ? child[k] : child[0];
    box[k] = box_of(here);
    reference[k] = inner ? inner_reference
                         : ref_leaf_bit | ref_instance_bit | sorted[is_leaf(here) ? here - args.count : 0u].y;
    inner_reference += inner ? 1u : 0u;
  }
  write_tlas_node(index, box, reference, count);
#endif
  queue[index].w = next;
  uint first = entry.y;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    if ((entry.z >> k & 1u) != 0u) queue[next++] = uvec4(child[k], first, 0u, 0u);
    first += k < entry.z >> 8 ? primitives_below(child[k]) : 0u;
  }
}

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint level = blas_levels + args.level * blas_level_words;
  const uint level_first = state[level + blas_level_first];
  const uint level_count = state[level + blas_level_count];
  // The total of the workgroups before this one.
  uint before = 0u;
  for (uint group = lane; group < gl_WorkGroupID.x; group += 64u) before += offsets[group];
  sums[lane] = before;
  for (uint step = 32u; step >= 1u; step /= 2u) {
    barrier();
    if (lane < step) sums[lane] += sums[lane + step];
  }
  barrier();
  before = sums[0];
  const uint i = gl_GlobalInvocationID.x;
  const uint next_level = level_first + level_count;
  if (i < level_count) queue_children(level_first + i, next_level + before);
  if (lane == 0u && gl_WorkGroupID.x == gl_NumWorkGroups.x - 1u) {
    const uint count = before + offsets[gl_WorkGroupID.x];
    const uint next = level + blas_level_words;
    state[next + blas_level_groups] = (count + 63u) / 64u;
    state[next + blas_level_groups + 1u] = state[next + blas_level_groups + 2u] = 1u;
    state[next + blas_level_first] = next_level;
    state[next + blas_level_count] = count;
  }
}
