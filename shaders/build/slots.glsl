// Which slot of a wide node each child takes. A ray visits slots in ascending order of slot ^ octant, where bit a of its octant
// says that it runs against axis a; so the child that lies farthest towards the corner of a slot belongs there (Ylitie, Karras
// and Laine 2017, greedily).
#ifndef RTSTDB_BUILD_SLOTS_GLSL
#define RTSTDB_BUILD_SLOTS_GLSL

// `away`: of the children's centres from the node's. Returns three bits a child. Loops are of constant length, so that arrays
// become registers.
uint choose_slots(vec3 away[8], uint count) {
  uint children_left = (1u << count) - 1u;
  uint slots_left = 0xFFu;
  uint slots = 0u;
  while (children_left != 0u) {
    float best = -3e38;
    uint best_child = 0u;
    uint best_slot = 0u;
    [[unroll]] for (uint k = 0u; k < 8u; ++k) {
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
    slots |= best_slot << 3u * best_child;
    children_left &= ~(1u << best_child);
    slots_left &= ~(1u << best_slot);
  }
  return slots;
}

#endif
