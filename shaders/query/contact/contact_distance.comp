#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The distance of each pair of convex bodies, or that they penetrate (distance.glsl).
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer hulls;
layout(set = 0, binding = 1, scalar) readonly buffer PairsBuffer { PairRecord pairs[]; };
layout(set = 0, binding = 2, scalar) buffer ResultsBuffer { PairResult results[]; };

uint rounds = 0u;
#include "query/contact/hull.glsl"
#include "query/contact/distance.glsl"

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) return;
  const PairRecord record = pairs[index];
  const vec3 direction =
      dot(record.center_m, record.center_m) > 0.0 ? normalize(record.center_m) : vec3(1.0, 0.0, 0.0);
  const PairDistance found = distance_between(first_hull_of(record), second_hull_of(record), direction,
                                              max(1e-5 * record.size_m, record.rounding_m), record.limit_m);
  // Where no direction is known along which the bodies are apart, the next stage decides.
  const bool may_penetrate = found.state == pair_undecided && found.lower <= 0.0;
  const uint decided = may_penetrate ? pair_penetrates : found.state;
  const uint state = loops_still_turn(args.loop_probe) ? decided : pair_unfinished;
  results[index] = PairResult(found.direction, found.upper, found.point, state, found.lower, found.upper);
}
