// Rays by a lane each, which goes through its own ray's search.
#ifndef RTSTDB_QUERY_TRAVERSE_GLSL
#define RTSTDB_QUERY_TRAVERSE_GLSL
#include "query/ray_steps.glsl"

// What is left of a ray's search.
struct Way {
  uint current;  // of the entities' tree
  Met met;
  uint below;  // of the geometry of the first of them, once that has been entered and not been left
  uint depth_below;
  Search search;  // of the entities' tree
  Found best;
};

// `root`: ref_none where nothing is asked.
Way begin_way(uint root, float lambda_max) {
  return Way(root, none_met(), ref_none, 0u, nothing_begun(), nothing_within(lambda_max));
}

bool is_left(Way way) { return way.current != ref_none || way.met.leaf[0] != ref_none; }

#ifdef RAY_PAUSES
const bool pauses = true;
#else
const bool pauses = false;
#endif

// Down the entities' tree until there is nothing left, `current` being ref_none then, or as many instances as fit are met.
void meet_instances(inout Way way, float share, Segment world, float lambda_min, float limit) {
  do {
    ++way.search.rounds;
    meet_next(way.current, way.met, way.search, share, world, lambda_min, limit);
  } while (another_round(goes_on(way.current, way.met) && may_go_on(way.search)));
}

// The loops of a ray's search through both levels of the structure (paper, Section 5.2): in each, one over nodes and one over leaves
// ("while-while", Aila and Laine 2009). Ends where nothing is left, or where it pauses.
//
// `t_ns`: since the epoch of the instances that stand from `instance_base` on. `share`: of the window that has passed then.
//
// On lavapipe whatever stands in a loop runs in each of its rounds, for nobody if need be, and a round more is made where the
// condition stands before the body. So conditions stand at the end, and no loop is begun again for what only some lanes may
// need: instances are met some at a time, and then entered, for lanes come by them at very different times.
void trace(inout Way way, Segment world, float lambda_min, int t_ns, float share, uint instance_base,
           uint mask, float faces, uint last_kept) {
  do {
    ++way.search.rounds;
    if (!pauses) way.met = none_met();
    meet_instances(way, share, world, lambda_min, reach_of(way.best));
    do {
      ++way.search.rounds;
      const bool enters_one = way.met.leaf[0] != ref_none;
      const bool begun = pauses && way.below != ref_none;
      const uint instance = enters_one ? (way.met.leaf[0] & ref_instance_mask) + instance_base : 0u;
      const Instance candidate = instance_at(instance);
      const Segment ray =
          enter_instance(world, candidate, t_ns, head_of(enters_one ? candidate.blas_root : 0u));
      Search there = Search(begun ? way.depth_below : 0u, way.search.rounds);
      uint below = begun                                         ? way.below
                   : enters_one && (candidate.mask & mask) != 0u ? candidate.blas_root
                                                                 : ref_none;
      do {
        ++there.rounds;
        below = go_through_leaves(below, there, ray, lambda_min, faces, last_kept, instance, candidate.entity,
                                  way.best);
      } while (another_round(below != ref_none && may_go_on(there)));
      way.search.rounds = there.rounds;
      way.depth_below = there.depth;
      way.below = below;
      const Met rest = rest_of(way.met, way.best);
      if (!pauses || below == ref_none) way.met = rest;
    } while (another_round(way.met.leaf[0] != ref_none && may_go_on(way.search)));
    way.current = unless_found(way.current, way.best);
  } while (another_round(is_left(way) && may_go_on(way.search)));
}

// What has been found once nothing is left. `two`: see loops_still_turn.
Found found_by(Way way, uint two) {
  Found found = way.best;
  bool cut_short = way.search.rounds >= max_rounds;
#ifdef RAY_ANY
  // A hit is one, whatever was not looked at.
  cut_short = cut_short && found.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(two)) found.status = status_incomplete;
  return found;
}

#endif
