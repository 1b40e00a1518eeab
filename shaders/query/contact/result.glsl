// The result of a stage for a pair, as the next stage and the host read it.
#ifndef RTSTDB_QUERY_CONTACT_RESULT_GLSL
#define RTSTDB_QUERY_CONTACT_RESULT_GLSL
#include "query/contact/real.glsl"

// A bound of the error of a support point of the Minkowski difference.
real rounding_of(PairRecord record) {
#ifdef CONTACT_DOUBLE
  // Poses have 48 bits, so their rounding is 2^-24 of that of single precision. The bound is above that and
  // above the rounding of double precision.
  return 1e-6LF * double(record.rounding_m);
#else
  return record.rounding_m;
#endif
}

// Single precision that is not above `value`, and that is not below it.
float rounded_down(real value) {
  const float near = float(value);
  return near - (real(near) > value ? 1.2e-7 * abs(near) + 1e-37 : 0.0);
}

float rounded_up(real value) { return -rounded_down(-value); }

// The result of a pair that is not decided yet.
PairResult result_of(real3 n, real3 point, real distance, real lower, real upper) {
  const float min_m = rounded_down(clamp(lower, real(-3e38), real(3e38)));
  const float max_m = rounded_up(clamp(upper, real(-3e38), real(3e38)));
  const float distance_m = clamp(float(clamp(distance, real(-3e38), real(3e38))), min_m, max_m);
  return PairResult(vec3(n), distance_m, vec3(point), pair_undecided, min_m, max_m);
}

#endif
