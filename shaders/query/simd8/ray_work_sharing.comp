#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Ray queries with work sharing: a workgroup is one subgroup, which traces its group's rays.
//
// Macros: RAY_ANY, RAY_MOVING (ray/ray.comp).
#include "query/simd8/work_sharing.glsl"
#include "query/simd8/halt_together.glsl"

layout(local_size_x = 8) in;

// Gives the next rays, from `next` on, to lanes without one.
void take_rays(inout RayState state, inout uint next, uint end) {
  const uint place = next + lanes_before(!state.is_active);
  const bool takes = !state.is_active && place < end;
  const uint index = takes ? place : args.first;
  const RayState begun = begin_ray(index, read_ray(index), args.root);
  if (takes) state = begun;
  next = min(next + count_of_lanes(!state.is_active || takes), end);
}

// Writes the answers of rays that are complete, or of all where the search is cut short.
void finish_rays(inout RayState state, bool cut_short) {
  if (state.is_active && (cut_short || is_done(state))) {
    Found found = state.best;
#ifdef RAY_ANY
    // A hit is a valid answer also where the search was cut short.
    cut_short = cut_short && found.status == status_miss;
#endif
    found.status = cut_short ? status_incomplete : found.status;
    answer(state.index, found, state.ray);
    state.is_active = false;
    state.current = ref_none;
    state.pending = no_pending();
    state.waits = false;
  }
}

void main() {
  uint next = args.first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * args.per_group;
  uint end = min(next + args.per_group, args.end);
  RayState state = no_ray(read_ray(args.first));
  WorkItem item = no_item(state.world);
  uint rounds = max_rounds - rounds_at_first;
  do {
    if (next < end && subgroup_halts(args.halt)) {
      report_unstarted(args.halt, next + args.halt_from);
      end = next;
    }
    const uint before = next;
    take_rays(state, next, end);
    rounds = min(rounds, max_rounds) - (next - before) * (rounds_at_first / 8u);
    rounds += 4u;  // including those of loops_still_turn
    uint done;
    bool cut_short;
    do {
      state.search.rounds = rounds + 1u;
      find_instances(state, item);
      begin_items(state, item);
      item.search.rounds = state.search.rounds;
      const bool more_waits = next < end || in_any(has_instances_left(state) ? 1u : 0u) != 0u;
      run_items(item, more_waits, args.faces);
      return_results(state, item);
      rounds = item.search.rounds;
      done = count_of_lanes(is_done(state));
      cut_short = in_any(rounds >= max_rounds ? 1u : 0u) != 0u;
    } while (!cut_short && done < 8u && (next == end || done < enough_free));
    cut_short = cut_short || !loops_still_turn(args.loop_probe);
    finish_rays(state, cut_short);
    if (cut_short) item = no_item(state.world);
  } while (next < end || in_any(state.is_active ? 1u : 0u) != 0u);
  if (!loops_still_turn(args.loop_probe)) some_unanswered = 1u;
}
