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

WideChildren choose_children(uint node, uint max_leaf, uint sorted_half) {
  WideChildren result;
  float area[8];
  result.child[0] = binary[node].x;
  result.child[1] = binary[node].y;
  result.count = 2u;
  for (uint k = 0u; k < 2u; ++k) {
    area[k] = stays_inner(result.child[k], max_leaf) ? box_half_area(box_of_child(result.child[k], sorted_half)) : -1.0;
  }
  while (result.count < 8u) {
    uint largest = 0u;
    for (uint k = 1u; k < result.count; ++k) largest = area[k] > area[largest] ? k : largest;
    if (area[largest] < 0.0) break;
    const uvec4 opened = binary[result.child[largest]];
    const uint slots[2] = uint[2](largest, result.count);
    const uint parts[2] = uint[2](opened.x, opened.y);
    for (uint k = 0u; k < 2u; ++k) {
      result.child[slots[k]] = parts[k];
      area[slots[k]] = stays_inner(parts[k], max_leaf) ? box_half_area(box_of_child(parts[k], sorted_half)) : -1.0;
    }
    ++result.count;
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

// Writes wide node `index` (absolute). The first inner child becomes wide node `next_first` (absolute), and so on.
void write_wide_node(uint index, WideChildren children, uint next_first, BuildArgs args, uint sorted_half) {
  Box child_box[8];
  Box all = Box(vec3(3e38), vec3(-3e38));
  for (uint k = 0u; k < children.count; ++k) {
    child_box[k] = box_of_child(children.child[k], sorted_half);
    all = box_union(all, child_box[k]);
  }
  // Rounding of coordinates in the traversal, absolute; the relative part is widened there.
  const vec3 rounding = max(abs(all.lo), abs(all.hi)) * 2.5e-7;
  const vec3 extent = all.hi - all.lo + 2.0 * rounding;
  const uvec3 exponent = uvec3(quantum_exponent(extent.x), quantum_exponent(extent.y), quantum_exponent(extent.z));
  const vec3 quantum = uintBitsToFloat(exponent << 23);
  const vec3 per_quantum = 1.0 / quantum;
  // Half a quantum of room below, so that the margin of the lowest child stays inside the byte.
  const vec3 origin = all.lo - rounding - 0.5 * quantum;
  const vec3 margin = 2e-3 + rounding * per_quantum;
  uvec4 edges[3] = uvec4[3](uvec4(0u), uvec4(0u), uvec4(0u));
  uvec4 refs[2] = uvec4[2](uvec4(ref_none), uvec4(ref_none));
  uint next = next_first;
  for (uint k = 0u; k < 8u; ++k) {
    const uint word = k >> 2;
    const uint lane = k & 3u;
    // An unused slot is a box turned inside out: no ray enters it.
    uvec3 lo = uvec3(255u);
    uvec3 hi = uvec3(0u);
    if (k < children.count) {
      lo = uvec3(clamp(floor((child_box[k].lo - origin) * per_quantum - margin), 0.0, 255.0));
      hi = uvec3(clamp(ceil((child_box[k].hi - origin) * per_quantum + margin), 0.0, 255.0));
      const bool inner = stays_inner(children.child[k], args.max_leaf);
      refs[word][lane] = inner ? next : leaf_reference(children.child[k], args, sorted_half);
      next += inner ? 1u : 0u;
    }
    for (uint axis = 0u; axis < 3u; ++axis) {
      edges[axis][word] |= lo[axis] << (8u * lane);
      edges[axis][2u + word] |= hi[axis] << (8u * lane);
    }
  }
  const uint base = index * node_texels;
  wide[base] = uvec4(floatBitsToUint(origin), exponent.x | exponent.y << 8 | exponent.z << 16);
  wide[base + 1u] = edges[0];
  wide[base + 2u] = edges[1];
  wide[base + 3u] = edges[2];
  wide[base + 4u] = refs[0];
  wide[base + 5u] = refs[1];
}

// A structure of one leaf has no binary node: its root holds that leaf alone.
void write_single_leaf_root(BuildArgs args, uint sorted_half) {
  WideChildren children;
  children.child[0] = leaf_child_bit;
  children.count = 1u;
  write_wide_node(args.node_base, children, 0u, args, sorted_half);
}

#endif
