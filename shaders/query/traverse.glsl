// Rays by a lane each, which goes through its own ray's search.
#ifndef RTSTDB_QUERY_TRAVERSE_GLSL
#define RTSTDB_QUERY_TRAVERSE_GLSL
#include "query/ray_steps.glsl"

// Down the entities' tree until there is nothing left, `current` being ref_none then, or as many instances as fit are met.
Met meet_instances(inout uint current, inout Search search, float share, Segment world, float lambda_min, float limit) {
  Met met = none_met();
  do {
    ++search.rounds;
    meet_next(current, met, search, share, world, lambda_min, limit);
  } while (another_round(goes_on(current, met)));
  return met;
}

// The loops of a ray's search through both levels of the structure (paper, Section 5.2): in each, one over nodes and one over leaves
// ("while-while", Aila and Laine 2009).
//
// `t_ns`: since the epoch of the instances that stand from `instance_base` on. `share`: of the window that has passed then.
// `root`: ref_none where nothing is asked. `two`: see loops_still_turn.
//
// On lavapipe whatever stands in a loop runs in each of its rounds, for nobody if need be, and a round more is made where the
// condition stands before the body. So conditions stand at the end, and no loop is begun again for what only some lanes may
// need: instances are met some at a time, and then entered, for lanes come by them at very different times.
Found trace(Segment world, float lambda_min, float lambda_max, int t_ns, float share, uint instance_base, uint mask, uint root,
            float faces, uint last_kept, uint two) {
  Found best = nothing_within(lambda_max);
  Search search = nothing_begun();
  uint current = root;
  do {
    ++search.rounds;
    Met met = meet_instances(current, search, share, world, lambda_min, reach_of(best));
    do {
      ++search.rounds;
      const bool enters_one = met.leaf[0] != ref_none;
      const uint instance = enters_one ? (met.leaf[0] & ref_instance_mask) + instance_base : 0u;
      const Instance candidate = instance_at(instance);
      const Segment ray = enter_instance(world, candidate, t_ns, head_of(enters_one ? candidate.blas_root : 0u));
      Search there = Search(0u, search.rounds);
      uint below = enters_one && (candidate.mask & mask) != 0u ? candidate.blas_root : ref_none;
      do {
        ++there.rounds;
        below = go_through_leaves(below, there, ray, lambda_min, faces, last_kept, instance, candidate.entity, best);
      } while (another_round(below != ref_none));
      search.rounds = there.rounds;
      met = rest_of(met, best);
    } while (another_round(met.leaf[0] != ref_none));
    current = unless_found(current, best);
  } while (another_round(current != ref_none));
  bool cut_short = search.rounds >= max_rounds;
#ifdef RAY_ANY
  // A hit is one, whatever was not looked at.
  cut_short = cut_short && best.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(two)) best.status = status_incomplete;
  return best;
}

#endif
