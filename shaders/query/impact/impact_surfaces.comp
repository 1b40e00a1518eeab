#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// A step of conservative advancement for pairs of surfaces. Their distance shrinks at most at the
// relative speed of the origins plus the speeds of the farthest points by rotation, so the surfaces do not
// meet while the time advances by the distance over this speed.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"
#include "shared/impact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer geometries;
layout(set = 0, binding = 3, scalar) readonly buffer PairsBuffer { AdvanceRecord pairs[]; };
layout(set = 0, binding = 4, scalar) buffer StatesBuffer { AdvanceState states[]; };
layout(set = 0, binding = 5, scalar) readonly buffer ActiveBuffer { uint active_pairs[]; };  // by place
#include "query/impact/surface_distance.glsl"
#include "query/nearest/winding.glsl"

// The relative error of distances: of bodies that are near, and of others, which take less work.
const float near_slack = 0.1;
const float far_slack = 0.4;

vec4 turned(vec4 q, vec3 w, double time_s) {
  return normalize(quat_product(rotation_after_long(dvec3(w), time_s), q));
}

// Whether the first corner of one surface lies in the body of the other.
bool is_within(PosedSurface surface, PosedSurface body) {
  if (!is_closed(body.geometry)) return false;
  const Triangle t = posed_triangle(surface, first_slot_of(surface.geometry));
  const Winding around = winding_around(root_of(body.geometry), (t.a - body.origin) * body.axes / body.scale);
  rounds += around.rounds;
  cut_short = cut_short || around.cut_short;
  return around.number != 0;
}

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
  const uint index = active_pairs[place];
  const AdvanceRecord record = pairs[index];
  AdvanceState state = states[index];
  // A halted stage is repeated for some pairs.
  const bool goes_on = state.state == advance_goes_on || state.state == advance_unfinished;
  if (!goes_on || state.steps >= max_surface_steps) return;
  double time_s = packDouble2x32(state.time_s);
  const double window_s = double(record.window_s);
  const dvec3 p = dvec3(record.p_m) + dvec3(record.p_low_m);
  const dvec3 v = dvec3(record.v_mps) + dvec3(record.v_low_mps);
  const float closing = (float(length(v)) + length(record.w_first_radps) * record.first_reach_m +
                         length(record.w_second_radps) * record.second_reach_m) *
                        1.000002;
  const vec4 q_second = turned(record.q_second, record.w_second_radps, time_s);
  const vec4 to_second = conjugate(q_second);
  const vec4 q = quat_product(to_second, turned(record.q_first, record.w_first_radps, time_s));
  const vec3 origin = rotate(to_second, vec3(p + v * time_s));
  const PosedSurface first = PosedSurface(record.first_body, record.first_scale, axes_of(q), origin);
  const PosedSurface second = PosedSurface(record.second_body, record.second_scale, mat3(1.0), vec3(0.0));
  SurfaceDistance found = distance_between(first, second, far_slack);
  if (found.lower <= record.tolerance_m) found = distance_between(first, second, near_slack);
  const bool is_inside =
      state.steps == 0u && found.upper > 0.0 && (is_within(first, second) || is_within(second, first));
  state.distance_m = is_inside ? 0.0 : found.upper;
  state.n = rotate(q_second, (found.first - found.second) / max(found.upper, 1e-37));
  const vec3 point = is_inside ? 0.5 * (found.first + found.second) : found.first;
  state.point_m = rotate(q_second, point - origin);
  const float target = 0.5 * record.tolerance_m;
  if (is_inside || found.upper <= record.tolerance_m) {
    state.state = advance_meets;
  } else if (found.lower <= target) {
    state.state = advance_undecided;
  } else {
    time_s = closing > 0.0 ? time_s + double((found.lower - target) / closing) : window_s;
    state.state = time_s >= window_s ? advance_ends : advance_goes_on;
    time_s = min(time_s, window_s);
  }
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  ++state.steps;
  state.time_s = unpackDouble2x32(time_s);
  // An unfinished step is made again.
  if (cut_short)
    states[index].state = advance_unfinished;
  else
    states[index] = state;
}
