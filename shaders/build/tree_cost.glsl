// What each node costs a ray at the least, as one child of a wide node, or opened into up to 2..7 of them, and how (Ylitie, Karras
// and Laine 2017, "Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", 3.1).
#ifndef RTSTDB_BUILD_TREE_COST_GLSL
#define RTSTDB_BUILD_TREE_COST_GLSL
#include "build/ray_price.glsl"
#include "build/tree_choice.glsl"

// A node with all that its parent wants to know of it.
struct Subtree {
  uint node;
  uint primitives;
  uint how;  // see tree_choice.glsl
  Box box;
  float cost[7];  // as 1..7 children
};

Subtree load_subtree(uint node) {
  Subtree tree;
  tree.node = node;
  tree.how = 0u;
  tree.box = box_of(node);
  // Without a branch: masked invocations would load anyway.
  const bool leaf = is_leaf(node);
  const uint place = leaf ? 0u : node;
  const vec4 low = costs_low[place];
  const vec4 high = costs_high[place];
  const float all = triangle_cost * box_half_area(tree.box);
  tree.primitives = leaf ? 1u : floatBitsToUint(high.w);
  tree.cost = float[7](leaf ? all : low.x, leaf ? all : low.y, leaf ? all : low.z, leaf ? all : low.w, leaf ? all : high.x,
                       leaf ? all : high.y, leaf ? all : high.z);
  return tree;
}

void store_subtree(Subtree tree, uint left, uint right) {
  box_lo[tree.node] = tree.box.lo;
  box_hi[tree.node] = tree.box.hi;
  binary[tree.node] = uvec4(left, right, tree.primitives, tree.how);
  costs_low[tree.node] = vec4(tree.cost[0], tree.cost[1], tree.cost[2], tree.cost[3]);
  costs_high[tree.node] = vec4(tree.cost[4], tree.cost[5], tree.cost[6], uintBitsToFloat(tree.primitives));
}

// The cheapest of all ways to make `node` from two subtrees.
Subtree join(uint node, Subtree a, Subtree b) {
  Subtree tree;
  tree.node = node;
  tree.primitives = a.primitives + b.primitives;
  tree.box = box_union(a.box, b.box);
  const float area = box_half_area(tree.box);
  float wide_cost = a.cost[0] + b.cost[6];
  uint wide_left = 1u;
  [[unroll]] for (uint k = 2u; k < 8u; ++k) {
    const float cost = a.cost[k - 1u] + b.cost[7u - k];
    wide_left = cost < wide_cost ? k : wide_left;
    wide_cost = min(cost, wide_cost);
  }
  const float inner = wide_cost + node_cost * area;
  const float as_leaf = triangle_cost * area * float(tree.primitives);
#ifdef BUILD_TLAS
  const bool leaf = false;
#else
  const bool leaf =
      tree.primitives <= blas_always_leaf || (tree.primitives <= max_triangles_per_leaf && as_leaf <= inner);
#endif
  tree.how = wide_left << choice_wide_shift | (leaf ? choice_leaf_bit : 0u);
  tree.cost[0] = leaf ? as_leaf : inner;
  [[unroll]] for (uint i = 2u; i < 8u; ++i) {
    float least = tree.cost[i - 2u];
    uint left = 0u;
    // Of constant length, or Mesa unrolls neither loop.
    [[unroll]] for (uint k = 1u; k < 7u; ++k) {
      const float cost = k < i ? a.cost[k - 1u] + b.cost[max(i, k + 1u) - k - 1u] : 3e38;
      left = cost < least ? k : left;
      least = min(cost, least);
    }
    tree.cost[i - 1u] = least;
    tree.how |= left << choice_shift(i);
  }
  return tree;
}

#endif
