// From the binary tree to nodes of up to 8 children: a wide node takes its binary node's children and keeps opening the one
// with the largest surface until 8 are had (surface-area guided, against the paper's fixed merging, which leaves slots
// empty). Subtrees of at most max_leaf primitives become leaves.
#ifndef RTSTDB_BUILD_PHASE_COLLAPSE_GLSL
#define RTSTDB_BUILD_PHASE_COLLAPSE_GLSL
#include "build/phase_fit.glsl"

struct WideChildren {
  uint child[8];  // binary children
  uint count;
};

uint primitives_below(uint child) {
  if ((child & leaf_child_bit) != 0u) return 1u;
  const uvec4 node = binary[child];
  return node.w - node.z + 1u;
}

bool stays_inner(uint child, uint max_leaf) { return primitives_below(child) > max_leaf; }

// What opening this child is worth; negative: it stays closed.
float opening_value(uint child, uint max_leaf, uint sorted_half) {
  return stays_inner(child, max_leaf) ? box_half_area(box_of_child(child, sorted_half)) : -1.0;
}

WideChildren choose_children(uint node, uint max_leaf, uint sorted_half) {
  WideChildren result;
  float value[8];
  result.child[0] = binary[node].x;
  result.child[1] = binary[node].y;
  value[0] = opening_value(result.child[0], max_leaf, sorted_half);
  value[1] = opening_value(result.child[1], max_leaf, sorted_half);
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
      value[best] = opening_value(opened.x, max_leaf, sorted_half);
      result.child[result.count] = opened.y;
      value[result.count] = opening_value(opened.y, max_leaf, sorted_half);
      ++result.count;
    }
  }
  return result;
}

uint inner_children(WideChildren children, uint max_leaf) {
  uint count = 0u;
  for (uint k = 0u; k < children.count; ++k) count += stays_inner(children.child[k], max_leaf) ? 1u : 0u;
  return count;
}

uint leaf_reference(uint child, BuildArgs args, uint sorted_half) {
  const bool single = (child & leaf_child_bit) != 0u;
  if (args.max_leaf == 1u) return ref_leaf_bit | args.leaf_bits | values[sorted_half + (child & ~leaf_child_bit)];
  const uint first = single ? (child & ~leaf_child_bit) : binary[child].z;
  const uint count = primitives_below(child);
  return ref_leaf_bit | args.leaf_bits | (count - 1u) << ref_triangle_count_shift | (args.leaf_base + first);
}

// Quantum of one axis as an exponent: the smallest power of two of which 254 cover the extent.
uint quantum_exponent(float extent) {
  const float needed = max(extent, 1e-30) / 254.0;
  const uint bits = floatBitsToUint(needed);
  return clamp((bits >> 23) + ((bits & 0x7FFFFFu) != 0u ? 1u : 0u), 1u, 254u);
}

// Which slot each child takes. A ray visits slots in ascending order of slot ^ octant, where bit a of its octant says that it
// runs against axis a; so the child that lies farthest towards the corner of a slot belongs there (Ylitie, Karras and Laine
// 2017, greedily).
void choose_slots(WideChildren children, vec3 center, uint sorted_half, out uint slot_of[8]) {
  vec3 away[8];
  for (uint k = 0u; k < children.count; ++k) away[k] = center_of(box_of_child(children.child[k], sorted_half)) - center;
  uint children_left = (1u << children.count) - 1u;
  uint slots_left = 0xFFu;
  for (uint round = 0u; round < children.count; ++round) {
    float best = -3e38;
    uint best_child = 0u;
    uint best_slot = 0u;
    for (uint k = 0u; k < children.count; ++k) {
      [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) {
        const float gain = ((slot & 1u) != 0u ? away[k].x : -away[k].x) + ((slot & 2u) != 0u ? away[k].y : -away[k].y) +
                           ((slot & 4u) != 0u ? away[k].z : -away[k].z);
        const bool free = (children_left >> k & 1u) != 0u && (slots_left >> slot & 1u) != 0u;
        const bool better = free && gain > best;
        best = better ? gain : best;
        best_child = better ? k : best_child;
        best_slot = better ? slot : best_slot;
      }
    }
    slot_of[best_child] = best_slot;
    children_left &= ~(1u << best_child);
    slots_left &= ~(1u << best_slot);
  }
}

// Writes wide node `index` (absolute). The first inner child becomes wide node `next_first` (absolute), and so on.
void write_wide_node(uint index, WideChildren children, uint next_first, BuildArgs args, uint sorted_half) {
  Box all = box_of_child(children.child[0], sorted_half);
  for (uint k = 1u; k < children.count; ++k) all = box_union(all, box_of_child(children.child[k], sorted_half));
  uint slot_of[8];
  choose_slots(children, center_of(all), sorted_half, slot_of);
  // Rounding of coordinates in the traversal, absolute; the relative part is widened there.
  const vec3 rounding = max(abs(all.lo), abs(all.hi)) * 2.5e-7;
  const vec3 extent = all.hi - all.lo + 2.0 * rounding;
  const uvec3 exponent = uvec3(quantum_exponent(extent.x), quantum_exponent(extent.y), quantum_exponent(extent.z));
  const vec3 quantum = uintBitsToFloat(exponent << 23);
  const vec3 per_quantum = 1.0 / quantum;
  // Half a quantum of room below, so that the margin of the lowest child stays inside the byte.
  const vec3 origin = all.lo - rounding - 0.5 * quantum;
  const vec3 margin = 2e-3 + rounding * per_quantum;
  // An unused slot is a box turned inside out: no ray enters it.
  uvec3 low_edges[2] = uvec3[2](uvec3(0xFFFFFFFFu), uvec3(0xFFFFFFFFu));
  uvec3 high_edges[2] = uvec3[2](uvec3(0u), uvec3(0u));
  uint refs[8] = uint[8](ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none);
  uint used = 0u;
  uint next = next_first;
  for (uint k = 0u; k < children.count; ++k) {
    const uint child = children.child[k];
    const uint slot = slot_of[k];
    const uint word = slot >> 2;
    const uint bit = 8u * (slot & 3u);
    const Box box = box_of_child(child, sorted_half);
    const uvec3 lo = uvec3(clamp(floor((box.lo - origin) * per_quantum - margin), 0.0, 255.0));
    const uvec3 hi = uvec3(clamp(ceil((box.hi - origin) * per_quantum + margin), 0.0, 255.0));
    low_edges[word] ^= (lo ^ 0xFFu) << bit;
    high_edges[word] |= hi << bit;
    const bool inner = stays_inner(child, args.max_leaf);
    refs[slot] = inner ? next : leaf_reference(child, args, sorted_half);
    next += inner ? 1u : 0u;
    used |= 1u << slot;
  }
  const uint base = index * node_texels;
  wide[base] = uvec4(floatBitsToUint(origin), exponent.x | exponent.y << 8 | exponent.z << 16 | used << 24);
  wide[base + 1u] = uvec4(low_edges[0].x, low_edges[1].x, high_edges[0].x, high_edges[1].x);
  wide[base + 2u] = uvec4(low_edges[0].y, low_edges[1].y, high_edges[0].y, high_edges[1].y);
  wide[base + 3u] = uvec4(low_edges[0].z, low_edges[1].z, high_edges[0].z, high_edges[1].z);
  wide[base + 4u] = uvec4(refs[0], refs[1], refs[2], refs[3]);
  wide[base + 5u] = uvec4(refs[4], refs[5], refs[6], refs[7]);
}

// A structure of one leaf has no binary node: its root holds that leaf alone.
void write_single_leaf_root(BuildArgs args, uint sorted_half) {
  WideChildren children;
  children.child[0] = leaf_child_bit;
  children.count = 1u;
  write_wide_node(args.node_base, children, 0u, args, sorted_half);
}

#endif
