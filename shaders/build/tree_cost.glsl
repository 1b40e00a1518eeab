// The least cost of each binary node for a ray, as one child of a wide node or opened into up to 2..7
// children, by dynamic programming (Ylitie, Karras and Laine 2017, "Efficient Incoherent Ray Traversal on
// GPUs Through Compressed Wide BVHs", 3.1).
#ifndef RTSTDB_BUILD_TREE_COST_GLSL
#define RTSTDB_BUILD_TREE_COST_GLSL
//
// The texels of an inner node: low corner and cost as one child; high corner and cost as two; costs as 3..6;
// cost as 7, number of primitives, decision word (tree_choice.glsl). Only passes that define TREE_WRITES
// include this file.
#include "build/sah_costs.glsl"
#include "build/tree_choice.glsl"

// A node with the values that its parent needs.
struct Subtree {
  uint node;
  uint primitives;
  uint decision;  // decision word, see tree_choice.glsl
  Box box;
  float cost[7];  // as 1..7 children
};

Subtree load_subtree(uint node) {
  Subtree subtree;
  subtree.node = node;
  subtree.decision = 0u;
  // Without a branch, since masked invocations load anyway.
  const bool leaf = is_leaf(node);
  const int texel = texel_of(node);
  const uvec4 t0 = tree_texel(texel);
  const uvec4 t1 = tree_texel(texel + 1);
  const uvec4 t2 = tree_texel(leaf ? 0 : texel + 2);
  const uvec4 t3 = tree_texel(leaf ? 0 : texel + 3);
  subtree.box = Box(uintBitsToFloat(t0.xyz), uintBitsToFloat(t1.xyz));
  const float all = triangle_cost * box_half_area(subtree.box);
  subtree.primitives = leaf ? 1u : t3.y;
  const uint stored[7] = uint[7](t0.w, t1.w, t2.x, t2.y, t2.z, t2.w, t3.x);
  [[unroll]] for (uint i = 0u; i < 7u; ++i) subtree.cost[i] = leaf ? all : uintBitsToFloat(stored[i]);
  return subtree;
}

void store_subtree(Subtree subtree, uint left, uint right) {
  const Destination to = destination_of(args.target, uint(texel_of(subtree.node)), 16u);
  uint cost[7];
  [[unroll]] for (uint i = 0u; i < 7u; ++i) cost[i] = floatBitsToUint(subtree.cost[i]);
  store_texel(to, 0u, uvec4(floatBitsToUint(subtree.box.lo), cost[0]));
  store_texel(to, 1u, uvec4(floatBitsToUint(subtree.box.hi), cost[1]));
  store_texel(to, 2u, uvec4(cost[2], cost[3], cost[4], cost[5]));
  store_texel(to, 3u, uvec4(cost[6], subtree.primitives, subtree.decision, 0u));
  binary[subtree.node] = uvec2(left, right);
}

// The node that joins two subtrees at the least cost.
Subtree join(uint node, Subtree a, Subtree b) {
  Subtree subtree;
  subtree.node = node;
  subtree.primitives = a.primitives + b.primitives;
  subtree.box = box_union(a.box, b.box);
  const float area = box_half_area(subtree.box);
  float wide_cost = a.cost[0] + b.cost[6];
  uint wide_left = 1u;
  [[unroll]] for (uint k = 2u; k < 8u; ++k) {
    const float cost = a.cost[k - 1u] + b.cost[7u - k];
    wide_left = cost < wide_cost ? k : wide_left;
    wide_cost = min(cost, wide_cost);
  }
  const float inner = wide_cost + node_cost * area;
  const float as_leaf = triangle_cost * area * float(subtree.primitives);
#ifdef BUILD_TLAS
  const bool leaf = false;
#else
  const bool leaf = subtree.primitives <= blas_always_leaf ||
                    (subtree.primitives <= max_triangles_per_leaf && as_leaf <= inner);
#endif
  subtree.decision = wide_left << choice_wide_shift | (leaf ? choice_leaf_bit : 0u);
  subtree.cost[0] = leaf ? as_leaf : inner;
  [[unroll]] for (uint i = 2u; i < 8u; ++i) {
    float least = subtree.cost[i - 2u];
    uint left = 0u;
    // A constant trip count, since Mesa otherwise unrolls neither loop.
    [[unroll]] for (uint k = 1u; k < 7u; ++k) {
      const float cost = k < i ? a.cost[k - 1u] + b.cost[max(i, k + 1u) - k - 1u] : 3e38;
      left = cost < least ? k : left;
      least = min(cost, least);
    }
    subtree.cost[i - 1u] = least;
    subtree.decision |= left << choice_shift(i);
  }
  return subtree;
}

#endif
