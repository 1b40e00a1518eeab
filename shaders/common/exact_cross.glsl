// A cross product of differences of points in about twice single precision, by error-free sums and products
// (Dekker 1971, Knuth 1969). Double precision gives the same result, but its 64-byte vectors are slow on some
// processors.
#ifndef RTSTDB_COMMON_EXACT_CROSS_GLSL
#define RTSTDB_COMMON_EXACT_CROSS_GLSL

// The rounding error of b - a.
vec3 lost_by_difference(vec3 b, vec3 a) {
  precise vec3 difference = b - a;
  precise vec3 without_b = difference - b;
  precise vec3 lost = (b - (difference - without_b)) - (a + without_b);
  return lost;
}

// The rounding error of a * b.
vec3 lost_by_product(vec3 a, vec3 b) {
  const float splits = 4097.0;  // splits into halves of 12 bits
  precise vec3 product = a * b;
  precise vec3 a_wide = a * splits;
  precise vec3 b_wide = b * splits;
  precise vec3 a_high = a_wide - (a_wide - a);
  precise vec3 b_high = b_wide - (b_wide - b);
  precise vec3 a_low = a - a_high;
  precise vec3 b_low = b - b_high;
  precise vec3 lost = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low;
  return lost;
}

// The largest power of two below the inverse of the largest component; multiplying by it changes no digit.
float scale_to_one(vec3 v) {
  const vec3 size = abs(v);
  return uintBitsToFloat(254u - (floatBitsToUint(max(max(size.x, size.y), size.z)) >> 23) << 23);
}

// The direction of (b - a) x (c - a), with any length but zero. If the points are nearly collinear, some
// direction perpendicular to their line.
vec3 direction_across(vec3 a, vec3 b, vec3 c) {
  const float to_b = scale_to_one(b - a);
  const float to_c = scale_to_one(c - a);
  const vec3 p = (b - a) * to_b;
  const vec3 q = (c - a) * to_c;
  const vec3 p_lost = lost_by_difference(b, a) * to_b;
  const vec3 q_lost = lost_by_difference(c, a) * to_c;
  precise vec3 whole = p.yzx * q.zxy - p.zxy * q.yzx;
  precise vec3 lost_of_both = lost_by_product(p.yzx, q.zxy) - lost_by_product(p.zxy, q.yzx);
  precise vec3 of_differences =
      (p.yzx * q_lost.zxy + p_lost.yzx * q.zxy) - (p.zxy * q_lost.yzx + p_lost.zxy * q.yzx);
  precise vec3 across = whole + (lost_of_both + of_differences);
  const vec3 across_p = abs(p.x) > abs(p.z) ? vec3(-p.y, p.x, 0.0) : vec3(0.0, -p.z, p.y);
  return across == vec3(0.0) ? across_p : across;
}

#endif
