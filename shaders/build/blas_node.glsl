// One wide node as queries read it (shaders/shared/node.h).
#ifndef RTSTDB_BUILD_BLAS_NODE_GLSL
#define RTSTDB_BUILD_BLAS_NODE_GLSL
#include "build/blas_scratch.glsl"

struct WideNode {
  Box box[8];
  uint reference[8];
  uint count;
};

// Quantum of one axis as an exponent: the smallest power of two of which 254 cover the extent.
uint quantum_exponent(float extent) {
  const float needed = max(extent, 1e-30) / 254.0;
  const uint bits = floatBitsToUint(needed);
  return clamp((bits >> 23) + ((bits & 0x7FFFFFu) != 0u ? 1u : 0u), 1u, 254u);
}

// Which slot each child takes. A ray visits slots in ascending order of slot ^ octant, where bit a of its octant says that it
// runs against axis a; so the child that lies farthest towards the corner of a slot belongs there (Ylitie, Karras and Laine
// 2017, greedily).
void choose_slots(WideNode node, vec3 center, out uint slot_of[8]) {
  vec3 away[8];
  for (uint k = 0u; k < node.count; ++k) away[k] = center_of(node.box[k]) - center;
  uint children_left = (1u << node.count) - 1u;
  uint slots_left = 0xFFu;
  while (children_left != 0u) {
    float best = -3e38;
    uint best_child = 0u;
    uint best_slot = 0u;
    for (uint k = 0u; k < node.count; ++k) {
      const vec3 to = away[k];
      const bool waits = (children_left >> k & 1u) != 0u;
      [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) {
        const float gain =
            ((slot & 1u) != 0u ? to.x : -to.x) + ((slot & 2u) != 0u ? to.y : -to.y) + ((slot & 4u) != 0u ? to.z : -to.z);
        const bool better = waits && (slots_left >> slot & 1u) != 0u && gain > best;
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

void write_wide_node(uint index, WideNode node) {
  Box all = node.box[0];
  for (uint k = 1u; k < node.count; ++k) all = box_union(all, node.box[k]);
  uint slot_of[8];
  choose_slots(node, center_of(all), slot_of);
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
  uint references[8] = uint[8](ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none);
  uint used = 0u;
  for (uint k = 0u; k < node.count; ++k) {
    const uint slot = slot_of[k];
    const uint bit = 8u * (slot & 3u);
    const uvec3 lo = uvec3(clamp(floor((node.box[k].lo - origin) * per_quantum - margin), 0.0, 255.0));
    const uvec3 hi = uvec3(clamp(ceil((node.box[k].hi - origin) * per_quantum + margin), 0.0, 255.0));
    low_edges[slot >> 2] ^= (lo ^ 0xFFu) << bit;
    high_edges[slot >> 2] |= hi << bit;
    references[slot] = node.reference[k];
    used |= 1u << slot;
  }
  const uint base = index * node_texels;
  wide[base] = uvec4(floatBitsToUint(origin), exponent.x | exponent.y << 8 | exponent.z << 16 | used << 24);
  wide[base + 1u] = uvec4(low_edges[0].x, low_edges[1].x, high_edges[0].x, high_edges[1].x);
  wide[base + 2u] = uvec4(low_edges[0].y, low_edges[1].y, high_edges[0].y, high_edges[1].y);
  wide[base + 3u] = uvec4(low_edges[0].z, low_edges[1].z, high_edges[0].z, high_edges[1].z);
  wide[base + 4u] = uvec4(references[0], references[1], references[2], references[3]);
  wide[base + 5u] = uvec4(references[4], references[5], references[6], references[7]);
}

#endif
