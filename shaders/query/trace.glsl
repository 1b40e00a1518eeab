// The loops of a ray's search through both levels of the structure (paper, Section 5.2): one over nodes, one over leaves
// ("while-while", Aila and Laine 2009).
//
// Include behind what they are made of (traverse.glsl, lane_pairs.glsl): Search, nothing_begun, descend_entities, descend_geometry,
// test_run, next_of_entities, next_of_geometry, reach, unless_found.
#ifndef RTSTDB_QUERY_TRACE_GLSL
#define RTSTDB_QUERY_TRACE_GLSL

// `t_ns`: since the epoch of the instances that stand from `instance_base` on. `share`: of the window that has passed then.
// `root`: ref_none where nothing is asked. `two`: see loops_still_turn.
//
// On lavapipe whatever stands in a loop runs in each of its rounds, for nobody if need be, and a round more is made where the
// condition stands before the body. So conditions stand at the end, and no loop is begun again for what only some lanes may
// need: instances that follow one another are met in a loop of their own. Why such loops ask again inside: common/loops.glsl.
Found trace(Segment world, float lambda_min, float lambda_max, int t_ns, float share, uint instance_base, uint mask, uint root,
            float faces, uint last_kept, uint two) {
  Found best = nothing_within(lambda_max);
  Search search = nothing_begun();
  uint current = root;
  if (current != ref_none) do {
    ++search.rounds;
    current = descend_entities(current, search, share, world, lambda_min, reach(best));
    if (current == ref_none) break;
    // Instances, as long as they follow one another.
    do {
      search.rounds += 4u;  // this loop's, and those that loops inside make for nobody
      if ((current & ref_leaf_bit) != 0u) {
        const uint instance = (current & ref_instance_mask) + instance_base;
        const Instance candidate = instance_at(instance);
        const Segment ray = enter_instance(world, candidate, t_ns, head_of(candidate.blas_root));
        const uint bottom = search.depth;
        current = (candidate.mask & mask) != 0u ? candidate.blas_root : ref_none;
        if (current != ref_none) do {
          ++search.rounds;
          current = descend_geometry(current, search, bottom, ray, lambda_min, reach(best));
          if (current == ref_none) break;
          // Leaves likewise.
          do {
            ++search.rounds;
            if ((current & ref_leaf_bit) != 0u) {
              test_run(current, search, ray, lambda_min, faces, last_kept, instance, candidate.entity, best);
              current = unless_found(next_of_geometry(search, bottom, ray.octant), best);
            }
          } while ((current & ref_leaf_bit) != 0u && current != ref_none);
        } while (current != ref_none);
        search.depth = bottom;
        current = unless_found(next_of_entities(search, world.octant), best);
      }
    } while ((current & ref_leaf_bit) != 0u && current != ref_none);
  } while (current != ref_none);
  bool cut_short = search.rounds >= max_rounds;
#ifdef RAY_ANY
  // A hit is one, whatever was not looked at.
  cut_short = cut_short && best.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(two)) best.status = status_incomplete;
  return best;
}

#endif
