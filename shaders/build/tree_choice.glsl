// The children of a wide node, as tree_cost.glsl has chosen them. How a node's cost is had, per number of children i: how many of
// them its left child gives, 0 when i - 1 children cost no more.
//   bits 0-17   three each for i = 2..7
//   bits 18-20  of the 8 children of a wide node
//   bit 21      as one child it is a leaf
#ifndef RTSTDB_BUILD_TREE_CHOICE_GLSL
#define RTSTDB_BUILD_TREE_CHOICE_GLSL
#include "build/tree_scratch.glsl"

const uint choice_wide_shift = 18u;
const uint choice_leaf_bit = 1u << 21;
uint choice_shift(uint children) { return 3u * (children - 2u); }

uint primitives_below(uint child) { return is_leaf(child) ? 1u : binary[child].z; }

struct Choice {
  uint child[8];
  uint count;
  uint inner;  // bit k: child k becomes a wide node
};

// A byte of the queue's third word each.
uint packed_choice(Choice choice) { return choice.inner | choice.count << 8; }

Choice choose_children(uint node) {
  Choice choice;
  choice.child[0] = node;
  choice.count = 1u;
  choice.inner = 0u;
  uvec4 opened = uvec4(0u);
  bool whole = is_leaf(node);
  if (!whole) {
    opened = binary[node];
    whole = (opened.w & choice_leaf_bit) != 0u;
  }
  // A structure of one leaf: its root holds that leaf alone.
  if (whole) return choice;
  // How many children each may still become, four bits a child.
  uint wanted = opened.w >> choice_wide_shift & 7u;
  wanted |= (8u - wanted) << 4;
  choice.child[0] = opened.x;
  choice.child[1] = opened.y;
  choice.count = 2u;
  uint k = 0u;
  while (k < choice.count) {
    const uint child = choice.child[k];
    const bool leaf = is_leaf(child);
    opened = binary[leaf ? 0u : child];
    uint children = wanted >> 4u * k & 15u;
    uint left = 0u;
    [[unroll]] for (uint i = 7u; i >= 2u; --i) {
      left = left == 0u && i <= children ? opened.w >> choice_shift(i) & 7u : left;
      children = left == 0u ? min(children, i - 1u) : children;
    }
    const bool split = !leaf && left != 0u;
    choice.child[k] = split ? opened.x : child;
    choice.child[split ? choice.count : k] = split ? opened.y : child;
    const uint both = (wanted & ~(15u << 4u * k)) | left << 4u * k | (children - left) << 4u * choice.count;
    wanted = split ? both : wanted;
    choice.count += split ? 1u : 0u;
    choice.inner |= !leaf && !split && (opened.w & choice_leaf_bit) == 0u ? 1u << k : 0u;
    k += split ? 0u : 1u;
  }
  // No slot stays empty beside an inner child: wide_node_bound counts on it.
  while (choice.count < 8u && choice.inner != 0u) {
    const uint widest = uint(findLSB(choice.inner));
    opened = binary[choice.child[widest]];
    choice.child[widest] = opened.x;
    choice.child[choice.count] = opened.y;
    const bool left_inner = !is_leaf(opened.x) && (binary[opened.x].w & choice_leaf_bit) == 0u;
    const bool right_inner = !is_leaf(opened.y) && (binary[opened.y].w & choice_leaf_bit) == 0u;
    choice.inner ^= left_inner ? 0u : 1u << widest;
    choice.inner |= right_inner ? 1u << choice.count : 0u;
    ++choice.count;
  }
  return choice;
}

#endif
