// A depth-first search that visits the nearest child first. Each waiting reference has a lower bound, for
// instance of the distance of its contents, and is skipped if the bound is beyond `box_limit` when it is
// popped.
//
// Included after `depth`, `rounds`, `cut_short` and `box_limit` are declared (nearest.comp, cone.comp).
#ifndef RTSTDB_QUERY_NEAREST_FIRST_GLSL
#define RTSTDB_QUERY_NEAREST_FIRST_GLSL
#include "shared/node.h"

const uint stack_size = 128u;
// Every inner node pushes at most 7 references.
const uint stack_limit = stack_size - 8u;
uint stack_ref[stack_size];
float stack_bound[stack_size];

bool is_inner(uint reference) { return (reference & ref_leaf_bit) == 0u; }

// Compares a child with the nearest one so far: the nearer of both becomes `nearest`, the other is pushed.
void offer_child(uint ref, float bound, inout uint nearest, inout float nearest_bound) {
  const bool in_reach = bound <= box_limit && ref != ref_none;
  const bool nearer = in_reach && bound < nearest_bound;
  stack_ref[depth] = nearer ? nearest : ref;
  stack_bound[depth] = nearer ? nearest_bound : bound;
  depth += (nearer ? nearest != ref_none : in_reach) ? 1u : 0u;
  nearest = nearer ? ref : nearest;
  nearest_bound = nearer ? bound : nearest_bound;
}

uint unless_full(uint nearest) {
  const bool full = depth > stack_limit;
  cut_short = cut_short || full;
  depth = full ? 0u : depth;
  return full ? ref_none : nearest;
}

// Pops the next reference above `bottom` that is within reach, or ref_none.
uint next_waiting(uint bottom) {
  uint next = ref_none;
  if (depth > bottom) do {
      ++rounds;
      if (next == ref_none && depth > bottom) {
        --depth;
        next = stack_bound[depth] <= box_limit ? stack_ref[depth] : ref_none;
      }
    } while (next == ref_none && depth > bottom);
  return next;
}

#endif
