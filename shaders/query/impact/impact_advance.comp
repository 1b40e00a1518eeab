#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Some steps of conservative advancement. At the time of a step the bodies are apart by a distance along a
// normal. The distance decreases at most at the closing speed of the origins along the normal plus the speeds
// of the farthest points by rotation. The time advances by the distance over this sum.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "common/motion.glsl"
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

dmat3 axes_at(vec4 q, vec3 w, double time_s) {
  return axes_of_pose(dvec4(normalize(quat_product(rotation_after_long(dvec3(w), time_s), q))));
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
  if (!goes_on || state.steps >= max_advance_steps) return;
  double time_s = packDouble2x32(state.time_s);
  const double window_s = double(record.window_s);
  const dvec3 p = dvec3(record.p_m) + dvec3(record.p_low_m);
  const dvec3 v = dvec3(record.v_mps) + dvec3(record.v_low_mps);
  const float turning = length(record.w_first_radps) * record.first_reach_m +
                        length(record.w_second_radps) * record.second_reach_m;
  const uint end = min(state.steps + steps_per_stage, max_advance_steps);
  do {
    ++rounds;
    if (goes_on) {
      ++state.steps;
      const dmat3 first_axes = axes_at(record.q_first, record.w_first_radps, time_s);
      const dmat3 second_axes = axes_at(record.q_second, record.w_second_radps, time_s);
      const dvec3 first_center =
          first_axes * dvec3(record.first_scale * texelFetch(hulls, int(record.first_body)).xyz);
      const dvec3 second_center =
          second_axes * dvec3(record.second_scale * texelFetch(hulls, int(record.second_body)).xyz);
      const dvec3 center = p + v * time_s + first_center - second_center;
      const Hull first = fetch_hull(record.first_body, dvec3(record.first_scale), first_axes, center);
      const Hull second =
          fetch_hull(record.second_body, dvec3(record.second_scale), second_axes, dvec3(0.0LF));
      const dvec3 direction = dot(center, center) > 0.0LF ? normalize(center) : dvec3(1.0LF, 0.0LF, 0.0LF);
      const double rounding =
          1e-13LF * (length(center) + double(record.first_reach_m + record.second_reach_m));
      const HullDistance found = distance_between(first, second, direction, rounding, real_max);
      const double skins = first.skin + second.skin;
      const double distance = found.inside > 0.0LF ? 0.0LF : max(found.upper - skins, 0.0LF);
      const double at_least = found.lower - skins;
      state.n = vec3(found.direction);
      state.distance_m = float(distance);
      // The hulls are relative to the second one's centre.
      state.point_m = vec3(found.point - first.skin * found.direction - center + first_center);
      const double target = 0.5LF * double(record.tolerance_m);
      const double closing = max(-dot(found.direction, v), 0.0LF) * 1.000001LF + double(turning) * 1.000001LF;
      if (distance <= double(record.tolerance_m)) {
        state.state = advance_meets;
        goes_on = false;
      } else if (at_least <= target) {
        state.state = advance_undecided;
        goes_on = false;
      } else {
        time_s = closing > 0.0LF ? time_s + max(at_least - target, 0.1LF * target) / closing : window_s;
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
