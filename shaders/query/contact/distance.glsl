// The distance of two convex bodies, or that they penetrate: the algorithm of Gilbert, Johnson and Keerthi
// (1988). It descends on the Minkowski difference to the point that is nearest to the origin; each support
// point also gives a lower bound of the distance. Included after hull.glsl.
#ifndef RTSTDB_QUERY_CONTACT_DISTANCE_GLSL
#define RTSTDB_QUERY_CONTACT_DISTANCE_GLSL
#include "query/contact/simplex.glsl"

const uint max_iterations = 64u;

struct PairDistance {
  vec3 direction;  // unit, from the second body to the first
  float lower;  // bounds of the distance; where `state` is pair_apart, equal to each other or above the limit
  float upper;
  vec3 point;  // of the first body
  uint state;  // pair_apart, pair_penetrates or pair_undecided
};

bool holds(Simplex s, vec3 w) {
  bool found = false;
  [[unroll]] for (uint i = 0u; i < 4u; ++i) found = found || (i < s.count && all(equal(s.w[i], w)));
  return found;
}

// The state of a search that has ended by bounds of the distance. They may be as close as single precision
// allows although the bodies penetrate deeply: when the origin lies in the plane of a face of the simplex.
// Only a direction along which the bodies are apart shows that they are.
uint state_by(float lower, float upper, float enough) {
  if (upper - lower > max(1e-6 * upper, 2.0 * enough)) return pair_undecided;
  return lower > 0.0 ? pair_apart : pair_penetrates;
}

// `direction`: unit, where the search begins. `enough`: the precision that suffices; bodies that are not
// apart by more count as penetrating. `limit`: the search ends when the distance is above it.
PairDistance distance_between(Hull first, Hull second, vec3 direction, float enough, float limit) {
  Simplex s;
  s.count = 0u;
  s.weights = vec4(0.0);
  vec3 a = vec3(0.0);
  float lower = 0.0;
  float upper = 3.4e38;
  uint state = pair_undecided;
  uint iteration = 0u;
  bool goes_on = true;
  do {
    ++rounds;
    if (goes_on) {
      const Difference found = support_of_difference(first, second, -direction);
      lower = max(lower, dot(direction, found.w));
      const bool is_far = lower > limit;
      // After a support point that is known, no other one follows.
      const bool ends =
          s.count > 0u && (upper - lower <= max(2.4e-7 * upper, 0.1 * enough) || holds(s, found.w));
      if (is_far || ends) {
        state = is_far ? pair_apart : state_by(lower, upper, enough);
        goes_on = false;
      } else {
        s.w[s.count] = found.w;
        s.a[s.count] = found.a;
        ++s.count;
        const NearestOfSimplex nearest = nearest_of(s);
        const float distance = sqrt(nearest.square);
        if (nearest.holds_origin || distance <= enough) {
          state = pair_penetrates;
          goes_on = false;
        } else if (distance >= upper) {
          // Rounding prevents a nearer point.
          state = state_by(lower, upper, enough);
          goes_on = false;
        } else {
          reduce(s, nearest.weights);
          vec3 v;
          nearest_points(s, v, a);
          direction = direction_to(s, v);
          upper = distance;
          goes_on = ++iteration < max_iterations;
        }
      }
    }
  } while (goes_on);
  return PairDistance(direction, min(lower, upper), upper, a, state);
}

#endif
