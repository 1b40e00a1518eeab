#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, per level of the wide tree, step 1 of 2: selects the children of the level's wide nodes, and
// the position of each node's inner children among those of its workgroup.
#include "build/tree_choice.glsl"

layout(local_size_x = 64) in;

shared uint counts[64];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint level = blas_levels + args.level * blas_level_words;
  const uint i = gl_GlobalInvocationID.x;
  const bool mine = i < state[level + blas_level_count];
  const uint index = state[level + blas_level_first] + i;
  uint inner = 0u;
  if (mine) {
    const Choice choice = choose_children(queue[index].x);
    children[2u * index] = uvec4(choice.child[0], choice.child[1], choice.child[2], choice.child[3]);
    children[2u * index + 1u] = uvec4(choice.child[4], choice.child[5], choice.child[6], choice.child[7]);
    queue[index].z = packed_choice(choice);
    inner = uint(bitCount(choice.inner));
  }
  counts[lane] = inner;
  barrier();
  if (lane == 0u) {
    uint sum = 0u;
    for (uint k = 0u; k < 64u; ++k) {
      const uint here = counts[k];
      counts[k] = sum;
      sum += here;
    }
    offsets[gl_WorkGroupID.x] = sum;
  }
  barrier();
  if (mine) queue[index].w = counts[lane];
}
