// The order of the triangles in the leaves. For each position the pass that writes wide nodes records the
// leaf's subtree and the triangle's number within it. The pass that writes triangles resolves them, one
// invocation per triangle.
#ifndef RTSTDB_BUILD_LEAF_ORDER_GLSL
#define RTSTDB_BUILD_LEAF_ORDER_GLSL
#include "build/tree_choice.glsl"

const uint leaf_rank_shift = 30u;

uint in_leaf(uint subtree, uint rank) { return subtree | rank << leaf_rank_shift; }

// The primitive at this position.
uint primitive_in_leaf(uint place) {
  uint node = place & ((1u << leaf_rank_shift) - 1u);
  uint rank = place >> leaf_rank_shift;
  [[unroll]] for (uint depth = 1u; depth < max_triangles_per_leaf; ++depth) {
    const bool inner = !is_leaf(node);
    const uvec2 children = children_of(inner ? node : 0u);
    const uint on_the_left = primitives_below(children.x);
    const bool left = rank < on_the_left;
    rank -= inner && !left ? on_the_left : 0u;
    node = inner ? (left ? children.x : children.y) : node;
  }
  return sorted[node - args.count].y;
}

#endif
