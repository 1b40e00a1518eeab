#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Steps of conservative advancement for pairs of surfaces. A step finds the least time in which any two
// triangles can come nearer than half the tolerance, and the time advances by it. A search that makes many
// visits pauses, and goes on in the next dispatch; where it pauses does not change its result.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"
#include "shared/impact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { SurfaceAdvanceArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer geometries;
layout(set = 0, binding = 3, scalar) readonly buffer PairsBuffer { AdvanceRecord pairs[]; };
layout(set = 0, binding = 4, scalar) buffer StatesBuffer { AdvanceState states[]; };
layout(set = 0, binding = 5, scalar) readonly buffer ActiveBuffer { ActiveSurfaces active_surfaces[]; };
layout(set = 0, binding = 6, scalar) buffer SearchesBuffer { ApproachSearch searches[]; };  // by slot
layout(set = 0, binding = 7, scalar) buffer SubtreePairsBuffer { SubtreePair subtree_pairs[]; };
#include "query/impact/surface_approach.glsl"
#include "query/nearest/winding.glsl"

// Visits of subtrees and triangles after which a pair pauses until the next dispatch.
const uint visits_until_pause = 500u;
// A step with more visits than this does not find its distance.
const uint max_visits = 1u << 22;

vec4 turned(vec4 q, vec3 w, double time_s) {
  return normalize(quat_product(rotation_after_long(dvec3(w), time_s), q));
}

Approach approach_at(AdvanceRecord record, double time_s, vec4 q_second) {
  const dvec3 p = dvec3(record.p_m) + dvec3(record.p_low_m);
  const dvec3 v = dvec3(record.v_mps) + dvec3(record.v_low_mps);
  const vec4 to_second = conjugate(q_second);
  const vec4 q = quat_product(to_second, turned(record.q_first, record.w_first_radps, time_s));
  const vec3 origin = rotate(to_second, vec3(p + v * time_s));
  const float size_m = length(origin) + record.first_reach_m + record.second_reach_m;
  return Approach(PosedSurface(record.first_body, record.first_scale, axes_of(q), origin),
                  PosedSurface(record.second_body, record.second_scale, mat3(1.0), vec3(0.0)),
                  rotate(to_second, record.v_mps), rotate(to_second, record.w_first_radps),
                  rotate(to_second, record.w_second_radps), record.tolerance_m, 5e-7 * size_m);
}

// Whether a point lies in a body.
bool is_within(vec3 point, PosedSurface body) {
  if (!is_closed(body.geometry)) return false;
  const Winding around =
      winding_around(root_of(body.geometry), (point - body.origin) * body.axes / body.scale);
  rounds += around.rounds;
  cut_short = cut_short || around.cut_short;
  return around.number != 0;
}

// Tests one corner of each surface.
void begin_pair(Approach approach, vec4 q_second, inout AdvanceState state) {
  const vec3 of_first = posed_triangle(approach.first, first_slot_of(approach.first.geometry)).a;
  const vec3 of_second = posed_triangle(approach.second, first_slot_of(approach.second.geometry)).a;
  const bool first_is_within = is_within(of_first, approach.second);
  const bool is_inside = first_is_within || is_within(of_second, approach.first);
  state.point_m = rotate(q_second, (first_is_within ? of_first : of_second) - approach.first.origin);
  state.state = is_inside ? advance_meets : advance_goes_on;
  state.phase = surfaces_between_steps;
}

// Ends a step whose search is complete.
void end_step(Approach approach, vec4 q_second, double window_s, inout double time_s,
              inout AdvanceState state) {
  if (search.after_s == 0.0) {
    state.state = advance_meets;
    state.distance_m = sqrt(search.square);
    state.n = rotate(q_second, search.between / max(state.distance_m, 1e-37));
    state.point_m = rotate(q_second, search.first - approach.first.origin);
  } else {
    time_s += double(time_fraction * search.after_s) * 0.999999LF;
    state.state = time_s >= window_s ? advance_ends : advance_goes_on;
    time_s = min(time_s, window_s);
  }
  ++state.steps;
  state.phase = surfaces_between_steps;
}

void resume_search(uint slot) {
  search = searches[slot];
  uint i = 0u;
  do {
    ++rounds;
    if (i < search.pending) {
      const SubtreePair next = subtree_pairs[slot * max_subtree_pairs + i];
      pending_first[i] = next.first;
      pending_second[i] = next.second;
      pending_after_s[i] = next.after_s;
      ++i;
    }
  } while (i < search.pending);
}

void pause_search(uint slot) {
  search.shapes = args.shapes;
  searches[slot] = search;
  uint i = 0u;
  do {
    ++rounds;
    if (i < search.pending) {
      subtree_pairs[slot * max_subtree_pairs + i] =
          SubtreePair(pending_first[i], pending_second[i], pending_after_s[i]);
      ++i;
    }
  } while (i < search.pending);
}

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
  const ActiveSurfaces at_place = active_surfaces[place];
  const AdvanceRecord record = pairs[at_place.pair];
  AdvanceState state = states[at_place.pair];
  // A halted stage is repeated for some pairs.
  bool goes_on = state.state == advance_goes_on || state.state == advance_unfinished;
  if (!goes_on || state.steps >= max_advance_steps) return;
  state.state = advance_goes_on;
  double time_s = packDouble2x32(state.time_s);
  const double window_s = double(record.window_s);
  vec4 q_second = turned(record.q_second, record.w_second_radps, time_s);
  Approach approach = approach_at(record, time_s, q_second);
  if (state.phase == surfaces_begin) {
    begin_pair(approach, q_second, state);
  } else {
    const bool is_resumed = state.phase == surfaces_in_step && searches[at_place.slot].shapes == args.shapes;
    if (is_resumed) resume_search(at_place.slot);
    bool begins = !is_resumed;
    uint visits = 0u;
    do {
      ++rounds;
      if (goes_on) {
        if (begins) {
          q_second = turned(record.q_second, record.w_second_radps, time_s);
          approach = approach_at(record, time_s, q_second);
          begin_search(float(window_s - time_s));
          state.phase = surfaces_in_step;
        }
        const uint visited = visit_next(approach);
        begins = visited == 0u;
        visits += max(visited, 1u);
        search.visits += visited;
        if (begins) end_step(approach, q_second, window_s, time_s, state);
        if (search.visits > max_visits || search.pending > pending_limit) state.state = advance_undecided;
        cut_short = cut_short || rounds > max_rounds;
        goes_on = state.state == advance_goes_on && state.steps < max_advance_steps &&
                  visits < visits_until_pause && !cut_short;
      }
    } while (goes_on);
  }
  if (state.phase == surfaces_in_step) pause_search(at_place.slot);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  state.time_s = unpackDouble2x32(time_s);
  // Steps of which one was cut short are made again from their begin: the slot has another search now.
  if (cut_short) {
    states[at_place.pair].state = advance_unfinished;
    states[at_place.pair].phase = min(states[at_place.pair].phase, surfaces_between_steps);
  } else {
    states[at_place.pair] = state;
  }
}
