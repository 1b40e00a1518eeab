// The distance of two hulls, or that they overlap: the algorithm of Gilbert, Johnson and Keerthi (1988). It
// descends on the Minkowski difference to the point that is nearest to the origin; each support point also
// gives a lower bound of the distance. Included after hull.glsl.
#ifndef RTSTDB_QUERY_CONTACT_DISTANCE_GLSL
#define RTSTDB_QUERY_CONTACT_DISTANCE_GLSL
#include "query/contact/simplex.glsl"

const uint max_iterations = 128u;

struct HullDistance {
  real3 direction;  // unit, from the second hull to the first; the lower bound is the gap along it
  real lower;       // bounds of the distance, without rounding; not above 0: the hulls may overlap
  real upper;
  real3 point;  // of the first hull
  real3 span;   // from the nearest point of the second hull to `point`; its length is the upper bound
  real inside;  // above 0: the hulls overlap, and the Minkowski difference holds a ball of this radius
};

bool holds(Simplex s, real3 w) {
  bool found = false;
  [[unroll]] for (uint i = 0u; i < 4u; ++i) found = found || (i < s.count && all(equal(s.w[i], w)));
  return found;
}

// `direction`: unit, where the search begins. `rounding`: bound of the error of a support point. The search
// ends when the distance is above `limit`.
HullDistance distance_between(Hull first, Hull second, real3 direction, real rounding, real limit) {
  Simplex s;
  s.count = 0u;
  s.weights = real4(0.0);
  HullDistance found = HullDistance(direction, -real_max, real_max, real3(0.0), real3(0.0), real(0.0));
  real3 next = direction;
  real3 a = real3(0.0);
  uint iteration = 0u;
  bool goes_on = true;
  do {
    ++rounds;
    if (goes_on) {
      const Difference support = support_of_difference(first, second, -next);
      const real gap = dot(next, support.w);
      if (gap > found.lower) {
        found.lower = gap;
        found.direction = next;
      }
      const bool is_exact = found.upper - found.lower <= real(2.0) * real_epsilon * found.upper;
      // After a support point that is known, no other one follows.
      goes_on = !(found.lower > limit || (s.count > 0u && (is_exact || holds(s, support.w))));
      if (goes_on) {
        s.w[s.count] = support.w;
        s.a[s.count] = support.a;
        ++s.count;
        const NearestOfSimplex nearest = nearest_of(s);
        const real distance = sqrt(nearest.square);
        // A positive gap contradicts a simplex that holds the origin by rounding.
        const bool overlaps = nearest.holds_origin && found.lower <= rounding;
        if (overlaps) {
          found.inside = nearest.inside;
          goes_on = false;
        } else if (nearest.holds_origin || distance >= found.upper) {
          goes_on = false;  // Rounding prevents a nearer point.
        } else {
          reduce(s, nearest.weights);
          real3 v;
          nearest_points(s, v, a);
          next = direction_to(s, v);
          found.upper = distance;
          found.point = a;
          found.span = v;
          goes_on = distance > rounding && ++iteration < max_iterations;
        }
      }
    }
  } while (goes_on);
  return found;
}

#endif
