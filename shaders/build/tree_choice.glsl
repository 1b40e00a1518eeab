// Selects the children of a wide node as tree_cost.glsl decided. The decision word of a binary node says how
// its cost with i children is reached: how many of them come from its left child, or 0 if i - 1 children cost
// no more.
//   bits 0-17   three bits each for i = 2..7
//   bits 18-20  for the 8 children of a wide node
//   bit 21      as a single child it is a leaf
#ifndef RTSTDB_BUILD_TREE_CHOICE_GLSL
#define RTSTDB_BUILD_TREE_CHOICE_GLSL
#include "build/tree_scratch.glsl"

const uint choice_wide_shift = 18u;
const uint choice_leaf_bit = 1u << 21;
uint choice_shift(uint children) { return 3u * (children - 2u); }

// For inner nodes only.
uvec4 last_texel_of(uint node) { return tree_texel(texel_of(node) + 3); }
uint decision_of(uint node) { return last_texel_of(node).z; }
uint primitives_below(uint child) {
  const bool leaf = is_leaf(child);
  const uint stored = last_texel_of(leaf ? 0u : child).y;
  return leaf ? 1u : stored;
}

struct Choice {
  uint child[8];
  uint count;
  uint inner;  // bit k: child k becomes a wide node
};

// The third word of a queue entry, one byte each.
uint packed_choice(Choice choice) { return choice.inner | choice.count << 8; }

// Whether a child becomes a wide node.
bool is_inner(uint child) {
  const bool leaf = is_leaf(child);
  return !leaf && (decision_of(leaf ? 0u : child) & choice_leaf_bit) == 0u;
}

Choice choose_children(uint node) {
  Choice choice;
  choice.child[0] = node;
  choice.count = 1u;
  choice.inner = 0u;
  uvec2 opened = uvec2(0u);
  uint decision = choice_leaf_bit;
  if (!is_leaf(node)) {
    opened = children_of(node);
    decision = decision_of(node);
  }
  // In a structure of one leaf the root holds that leaf alone.
  if ((decision & choice_leaf_bit) != 0u) return choice;
  // The number of children that each may still become, four bits per child.
  uint wanted = decision >> choice_wide_shift & 7u;
  wanted |= (8u - wanted) << 4;
  choice.child[0] = opened.x;
  choice.child[1] = opened.y;
  choice.count = 2u;
  uint k = 0u;
  while (k < choice.count) {
    const uint child = choice.child[k];
    const bool leaf = is_leaf(child);
    opened = children_of(leaf ? 0u : child);
    decision = decision_of(leaf ? 0u : child);
    uint children = wanted >> 4u * k & 15u;
    uint left = 0u;
    [[unroll]] for (uint i = 7u; i >= 2u; --i) {
      left = left == 0u && i <= children ? decision >> choice_shift(i) & 7u : left;
      children = left == 0u ? min(children, i - 1u) : children;
    }
    const bool split = !leaf && left != 0u;
    choice.child[k] = split ? opened.x : child;
    choice.child[split ? choice.count : k] = split ? opened.y : child;
    const uint both = (wanted & ~(15u << 4u * k)) | left << 4u * k | (children - left) << 4u * choice.count;
    wanted = split ? both : wanted;
    choice.count += split ? 1u : 0u;
    choice.inner |= !leaf && !split && (decision & choice_leaf_bit) == 0u ? 1u << k : 0u;
    k += split ? 0u : 1u;
  }
  // No slot stays empty beside an inner child, which wide_node_bound relies on.
  while (choice.count < 8u && choice.inner != 0u) {
    const uint widest = uint(findLSB(choice.inner));
    opened = children_of(choice.child[widest]);
    choice.child[widest] = opened.x;
    choice.child[choice.count] = opened.y;
    choice.inner ^= is_inner(opened.x) ? 0u : 1u << widest;
    choice.inner |= is_inner(opened.y) ? 1u << choice.count : 0u;
    ++choice.count;
  }
  return choice;
}

#endif
