#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, step 5: the cost of the root, and the first level of the wide tree.
#include "build/tree_cost.glsl"

layout(local_size_x = 64) in;

void main() {
  if (gl_GlobalInvocationID.x != 0u || args.count == 0u || state[blas_disorder] != 0u) return;
  const uint root = state[blas_root];
  if (!is_leaf(root)) {
    const uvec2 children = children_of(root);
    store_subtree(join(root, load_subtree(children.x), load_subtree(children.y)), children.x, children.y);
  }
  const uint level = blas_levels;
  state[level + blas_level_groups] = state[level + blas_level_groups + 1u] =
      state[level + blas_level_groups + 2u] = 1u;
  state[level + blas_level_first] = 0u;
  state[level + blas_level_count] = 1u;
  queue[0] = uvec4(root, 0u, 0u, 0u);
}
