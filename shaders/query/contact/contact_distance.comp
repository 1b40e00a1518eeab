#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The distance of each pair of convex bodies, or that they overlap (distance.glsl): in single precision for
// all pairs, then with CONTACT_DOUBLE in double precision for those that single precision does not decide,
// and for curved bodies, whose normals it does not know well.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer hulls;
layout(set = 0, binding = 1, scalar) readonly buffer PairsBuffer { PairRecord pairs[]; };
layout(set = 0, binding = 2, scalar) buffer ResultsBuffer { PairResult results[]; };
#ifdef CONTACT_DOUBLE
layout(set = 0, binding = 3, scalar) readonly buffer ListedBuffer { uint listed[]; };  // pairs by place
#endif

uint rounds = 0u;
#include "query/contact/hull.glsl"
#include "query/contact/distance.glsl"
#include "query/contact/result.glsl"

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
#ifdef CONTACT_DOUBLE
  const uint index = listed[place];
#else
  const uint index = place;
#endif
  const PairRecord record = pairs[index];
  const Hull first = first_hull_of(record);
  const Hull second = second_hull_of(record);
  const real skins = first.skin + second.skin;
  const real omitted = real(record.omitted_m);
  const real rounding = rounding_of(record);
  const real3 center = first.center;
  const real3 direction =
      dot(center, center) > real(0.0) ? normalize(center) : real3(real(1.0), real(0.0), real(0.0));
  const real limit = real(record.limit_m) + skins + rounding;
  const HullDistance found = distance_between(first, second, direction, rounding, limit);

  const bool is_curved = first.round_radius > real(0.0) || second.round_radius > real(0.0);
  const bool is_far = found.lower > limit;
  const bool is_precise = found.upper - found.lower <= real(0.25) * real(record.precision_m);
  real3 n = found.direction;
  uint state;
  real nearest = found.upper;
#ifdef CONTACT_DOUBLE
  if (is_curved) n = refined_by_axis(first, second, n);
  state = is_far || (found.lower > rounding && is_precise) ? pair_known : pair_needs_depth;
#else
  const bool overlaps = found.inside > rounding;
  nearest = overlaps ? -found.inside : nearest;
#endif
  PairResult result = result_of(n, found.point - first.skin * n, nearest - skins,
                                found.lower - rounding - skins - omitted, nearest + rounding - skins);
#ifndef CONTACT_DOUBLE
  // Rounding turns the normal by less than a degree.
  const bool has_normal = found.lower > 100.0 * rounding;
  // Contact points need the nearest points of both bodies. The answer has one of them and the direction; the
  // other one follows only if the span has that direction.
  const bool has_points = found.lower > record.margin_m + rounding ||
                          distance(found.span, found.upper * n) <= 0.25 * record.precision_m;
  const bool is_narrow = result.max_m - result.min_m <= record.precision_m;
  const bool is_sure = has_normal && !is_curved && is_narrow && has_points;
  state = is_far || is_sure ? pair_known : overlaps ? pair_needs_depth : pair_needs_double;
#endif
  result.state = loops_still_turn(args.loop_probe) ? state : pair_unfinished;
  results[index] = result;
}
