// Assigns the children of a wide node to its slots. A ray visits slots in ascending order of slot ^ octant,
// where bit a of its octant is set if its direction is negative along axis a (any-hit rays in descending
// order). So each slot receives the child that lies farthest towards its corner, greedily (Ylitie, Karras and
// Laine 2017).
#ifndef RTSTDB_BUILD_SLOTS_GLSL
#define RTSTDB_BUILD_SLOTS_GLSL
#include "common/bounds.glsl"

// A number that orders gains, with child and slot in its lowest six bits. Gains that differ by less than
// 2^-17 of their value compare equal. Never 0.
uint gain_key(vec3 to, uint child, uint slot) {
  const float gain = ((slot & 1u) != 0u ? to.x : -to.x) + ((slot & 2u) != 0u ? to.y : -to.y) +
                     ((slot & 4u) != 0u ? to.z : -to.z);
  return (ordered(gain) & ~63u) | child << 3u | slot;
}

// `away` holds the children's centres relative to the node's. Returns three bits per child. Loops have
// constant trip counts, so that the compiler keeps arrays in registers.
uint choose_slots(vec3 away[8], uint count) {
  uint key[64];
  // All ones while the child is not placed, or the slot is free.
  uint unplaced[8];
  uint free[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    unplaced[k] = k < count ? ~0u : 0u;
    free[k] = ~0u;
    [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) key[8u * k + slot] = gain_key(away[k], k, slot);
  }
  uint slots = 0u;
  uint placed = 0u;
  do {
    uint best = 0u;
    [[unroll]] for (uint k = 0u; k < 8u; ++k) {
      [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) best =
          max(best, key[8u * k + slot] & unplaced[k] & free[slot]);
    }
    const uint child = best >> 3u & 7u;
    const uint slot = best & 7u;
    slots |= placed < count ? slot << 3u * child : 0u;
    [[unroll]] for (uint k = 0u; k < 8u; ++k) {
      unplaced[k] = k == child ? 0u : unplaced[k];
      free[k] = k == slot ? 0u : free[k];
    }
    ++placed;
  } while (placed < count);
  return slots;
}

#endif
