// The search of one ray per lane.
#ifndef RTSTDB_QUERY_RAY_TRAVERSE_GLSL
#define RTSTDB_QUERY_RAY_TRAVERSE_GLSL
#include "query/ray/steps.glsl"

// The state of a ray's search.
struct TraversalState {
  uint current;  // in the TLAS
  PendingInstances pending;
  uint below;  // in the geometry of the first pending instance, while that is entered; else ref_none
  uint depth_below;
  Search search;  // in the TLAS
  Found best;
};

// `root`: ref_none for a lane without a ray.
TraversalState begin_traversal(uint root, float lambda_max) {
  return TraversalState(root, no_pending(), ref_none, 0u, nothing_begun(), nothing_within(lambda_max));
}

bool is_unfinished(TraversalState state) {
  return state.current != ref_none || state.pending.leaf[0] != ref_none;
}

#ifdef RAY_PAUSES
const bool pauses = true;
#else
const bool pauses = false;
#endif

// Goes down the TLAS until no node is left (`current` is ref_none) or the list of pending instances is full.
void find_instances(inout TraversalState state, float share, Segment world, float lambda_min, float limit) {
  do {
    ++state.search.rounds;
    visit_next(state.current, state.pending, state.search, share, world, lambda_min, limit);
  } while (another_round(goes_on(state.current, state.pending) && may_go_on(state.search)));
}

// A ray's search through both levels of the structure (paper, Section 5.2): in each level, a loop over nodes
// and a loop over leaves ("while-while", Aila and Laine 2009). Ends when nothing is left, or when it pauses.
//
// `t_ns`: since the epoch of the instances from `instance_base` on. `share`: the part of the window that has
// passed then.
//
// On lavapipe every lane runs the body of a loop in each iteration, masked or not, and a condition before the
// body costs one more iteration. So conditions stand at the end, and instances are collected before they are
// entered: lanes find them at very different times, and entering each at once would restart the inner loops
// for few lanes.
void trace(inout TraversalState state, Segment world, float lambda_min, int t_ns, float share,
           uint instance_base, uint mask, float faces, uint last_kept) {
  do {
    ++state.search.rounds;
    if (!pauses) state.pending = no_pending();
    find_instances(state, share, world, lambda_min, reach_of(state.best));
    do {
      ++state.search.rounds;
      const bool enters_one = state.pending.leaf[0] != ref_none;
      const bool begun = pauses && state.below != ref_none;
      const uint instance = enters_one ? (state.pending.leaf[0] & ref_instance_mask) + instance_base : 0u;
      const Instance candidate = instance_at(instance);
      const Segment ray =
          enter_instance(world, candidate, t_ns, head_of(enters_one ? candidate.blas_root : 0u));
      Search there = Search(begun ? state.depth_below : 0u, state.search.rounds);
      uint below = begun                                         ? state.below
                   : enters_one && (candidate.mask & mask) != 0u ? candidate.blas_root
                                                                 : ref_none;
      do {
        ++there.rounds;
        below = go_through_leaves(below, there, ray, lambda_min, faces, last_kept, instance, candidate.entity,
                                  state.best);
      } while (another_round(below != ref_none && may_go_on(there)));
      state.search.rounds = there.rounds;
      state.depth_below = there.depth;
      state.below = below;
      const PendingInstances rest = rest_of(state.pending, state.best);
      if (!pauses || below == ref_none) state.pending = rest;
    } while (another_round(state.pending.leaf[0] != ref_none && may_go_on(state.search)));
    state.current = unless_found(state.current, state.best);
  } while (another_round(is_unfinished(state) && may_go_on(state.search)));
}

// The result of a search that has ended. `loop_probe`: see loops_still_turn.
Found found_by(TraversalState state, uint loop_probe) {
  Found found = state.best;
  bool cut_short = state.search.rounds >= max_rounds;
#ifdef RAY_ANY
  // A hit is a valid answer also where the search was cut short.
  cut_short = cut_short && found.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(loop_probe)) found.status = status_incomplete;
  return found;
}

#endif
