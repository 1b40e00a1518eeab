#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Some steps of conservative advancement. At the time of a step the bodies are apart by a distance along a
// normal. The distance decreases at most at the closing speed of the origins along the normal plus the speeds
// of the farthest points by rotation. The time advances by the distance over this sum.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"
#include "shared/impact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer hulls;
layout(set = 0, binding = 1, scalar) readonly buffer PairsBuffer { AdvanceRecord pairs[]; };
layout(set = 0, binding = 2, scalar) buffer StatesBuffer { AdvanceState states[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ActiveBuffer { uint active_pairs[]; };  // by place

uint rounds = 0u;
#include "query/contact/hull.glsl"
#include "query/contact/distance.glsl"

mat3 axes_at(vec4 q, vec3 w, double time_s) {
  return axes_of(normalize(quat_product(rotation_after_long(dvec3(w), time_s), q)));
}

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
  const uint index = active_pairs[place];
  const AdvanceRecord record = pairs[index];
  AdvanceState state = states[index];
  // A halted stage is repeated for some pairs.
  bool goes_on = state.state == advance_goes_on || state.state == advance_unfinished;
  if (!goes_on || state.steps >= max_convex_steps) return;
  double time_s = packDouble2x32(state.time_s);
  const double window_s = double(record.window_s);
  const dvec3 p = dvec3(record.p_m) + dvec3(record.p_low_m);
  const dvec3 v = dvec3(record.v_mps) + dvec3(record.v_low_mps);
  const float turning = length(record.w_first_radps) * record.first_reach_m +
                        length(record.w_second_radps) * record.second_reach_m;
  const uint end = min(state.steps + steps_per_stage, max_convex_steps);
  do {
    ++rounds;
    if (goes_on) {
      ++state.steps;
      const vec3 between = vec3(p + v * time_s);
      const mat3 first_axes = axes_at(record.q_first, record.w_first_radps, time_s);
      const mat3 second_axes = axes_at(record.q_second, record.w_second_radps, time_s);
      const Hull second = fetch_hull(record.second_body, record.second_scale, second_axes, vec3(0.0));
      const vec3 second_center =
          second_axes * (record.second_scale * texelFetch(hulls, int(record.second_body)).xyz);
      const vec3 first_center =
          first_axes * (record.first_scale * texelFetch(hulls, int(record.first_body)).xyz);
      const vec3 center = between + first_center - second_center;
      const Hull first = fetch_hull(record.first_body, record.first_scale, first_axes, center);
      const vec3 direction = dot(center, center) > 0.0 ? normalize(center) : vec3(1.0, 0.0, 0.0);
      const PairDistance found = distance_between(first, second, direction, record.enough_m, 3.4e38);
      state.n = found.direction;
      state.distance_m = found.upper;
      // The hulls are relative to the second one's centre.
      state.point_m = found.point - center + first_center;
      const float target = 0.5 * record.tolerance_m;
      const float closing =
          float(max(-dot(dvec3(found.direction), v), 0.0LF)) * 1.000001 + turning * 1.000001;
      if (found.state == pair_penetrates || found.upper <= record.tolerance_m) {
        state.state = advance_meets;
        state.distance_m = found.state == pair_penetrates ? 0.0 : found.upper;
        goes_on = false;
      } else if (found.state == pair_undecided && found.lower <= target) {
        state.state = advance_undecided;
        goes_on = false;
      } else {
        time_s =
            closing > 0.0 ? time_s + double(max(found.lower - target, 0.1 * target) / closing) : window_s;
        const bool ends = time_s >= window_s;
        time_s = min(time_s, window_s);
        state.state = ends ? advance_ends : advance_goes_on;
        goes_on = !ends && state.steps < end && rounds < max_rounds / 4u;
      }
    }
  } while (goes_on);
  state.time_s = unpackDouble2x32(time_s);
  // Steps of which one was cut short are made again.
  if (loops_still_turn(args.loop_probe))
    states[index] = state;
  else
    states[index].state = advance_unfinished;
}
