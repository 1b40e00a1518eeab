// Collapses the binary tree of a TLAS into nodes of up to 8 children: a wide node starts with the children of
// its binary node and opens the child with the largest surface until it has 8. Opening by surface area fills
// the slots, which the paper's fixed merging of levels does not. The refit computes the boxes.
#ifndef RTSTDB_BUILD_PHASE_COLLAPSE_GLSL
#define RTSTDB_BUILD_PHASE_COLLAPSE_GLSL
#include "build/phase_fit.glsl"
#include "build/tlas_node.glsl"

struct WideChildren {
  uint child[8];  // binary nodes
  uint count;
};

bool is_inner(uint child) { return (child & leaf_child_bit) == 0u; }

// The gain of opening this child; negative if it can not be opened.
float opening_value(uint child) { return is_inner(child) ? box_half_area(box_of_child(child)) : -1.0; }

WideChildren choose_children(uint node) {
  WideChildren result;
  float value[8];
  result.child[0] = binary[node].x;
  result.child[1] = binary[node].y;
  value[0] = opening_value(result.child[0]);
  value[1] = opening_value(result.child[1]);
  result.count = 2u;
  bool open = true;
  while (open && result.count < 8u) {
    uint best = 0u;
    float best_value = value[0];
    for (uint k = 1u; k < result.count; ++k) {
      best = value[k] > best_value ? k : best;
      best_value = max(best_value, value[k]);
    }
    open = best_value >= 0.0;
    if (open) {
      const uvec4 opened = binary[result.child[best]];
      result.child[best] = opened.x;
      value[best] = opening_value(opened.x);
      result.child[result.count] = opened.y;
      value[result.count] = opening_value(opened.y);
      ++result.count;
    }
  }
  return result;
}

uint inner_children(WideChildren children) {
  uint count = 0u;
  for (uint k = 0u; k < children.count; ++k) count += is_inner(children.child[k]) ? 1u : 0u;
  return count;
}

// Writes slots and references of wide node `index`. Its inner children become wide nodes from `next_first`
// on.
void write_tree_node(uint index, WideChildren children, uint next_first) {
  Box box[8];
  uint reference[8];
  uint next = next_first;
  for (uint k = 0u; k < 8u; ++k) {
    const uint child = children.child[k < children.count ? k : 0u];
    const bool inner = is_inner(child);
    box[k] = box_of_child(child);
    reference[k] = inner ? next : ref_leaf_bit | ref_instance_bit | values[child & ~leaf_child_bit];
    next += inner ? 1u : 0u;
  }
  write_tlas_node(index, box, reference, children.count);
}

// A tree of one leaf has no binary node; its root holds that leaf alone.
void write_single_leaf_root() {
  WideChildren children;
  children.child[0] = leaf_child_bit;
  children.count = 1u;
  write_tree_node(0u, children, 0u);
}

#endif
