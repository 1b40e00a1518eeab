// The point of a simplex of one to four points that is nearest to the origin.
#ifndef RTSTDB_QUERY_CONTACT_SIMPLEX_GLSL
#define RTSTDB_QUERY_CONTACT_SIMPLEX_GLSL
#include "query/contact/real.glsl"

struct Simplex {
  real3 w[4];
  real3 a[4];  // see Difference
  real4 weights;
  uint count;
};

struct NearestOfSimplex {
  real4 weights;  // exactly 0: the nearest point does not depend on this point
  real square;
  bool holds_origin;
  // Lower bound, above 0, of the origin's distance from the faces; only if the simplex holds the origin.
  real inside;
};

// The point of a triangle, or of the whole triangle's border, that is nearest to the origin.
struct NearestOfTriangle {
  real3 weights;
  real square;
};

// `along`: the weight of b. The computation starts from the nearer end.
real3 nearest_of_edge(real3 a, real3 b, out real along) {
  const bool turned = dot(b, b) < dot(a, a);
  const real3 from = turned ? b : a;
  const real3 edge = (turned ? a : b) - from;
  const real share = clamp(-dot(from, edge) / max(dot(edge, edge), real_tiny), real(0.0), real(1.0));
  along = turned ? real(1.0) - share : share;
  return from + share * edge;
}

// The nearest point of the three edges, and of the face where the perpendicular foot lies inside the
// triangle: always a point of the triangle, even of a sliver. The weight of a corner that is not on the
// nearest edge is exactly 0.
NearestOfTriangle nearest_of_triangle(real3 a, real3 b, real3 c) {
  real along_ab, along_ac, along_bc;
  const real3 on_ab = nearest_of_edge(a, b, along_ab);
  const real3 on_ac = nearest_of_edge(a, c, along_ac);
  const real3 on_bc = nearest_of_edge(b, c, along_bc);
  NearestOfTriangle best =
      NearestOfTriangle(real3(real(1.0) - along_ab, along_ab, real(0.0)), dot(on_ab, on_ab));
  const real ac_square = dot(on_ac, on_ac);
  if (ac_square < best.square)
    best = NearestOfTriangle(real3(real(1.0) - along_ac, real(0.0), along_ac), ac_square);
  const real bc_square = dot(on_bc, on_bc);
  if (bc_square < best.square)
    best = NearestOfTriangle(real3(real(0.0), real(1.0) - along_bc, along_bc), bc_square);
  const real3 ab = b - a;
  const real3 ac = c - a;
  const real3 n = cross(ab, ac);
  const real share = real(1.0) / max(dot(n, n), real_tiny);
  const real v = dot(cross(ac, a), n) * share;
  const real w = dot(cross(a, ab), n) * share;
  const real3 foot = a + v * ab + w * ac;
  const real foot_square = dot(foot, foot);
  const bool is_in_face = v > real(0.0) && w > real(0.0) && v + w < real(1.0);
  if (is_in_face && foot_square < best.square)
    best = NearestOfTriangle(real3(real(1.0) - v - w, v, w), foot_square);
  return best;
}

real4 weights_of(NearestOfTriangle point, uvec3 corners) {
  real4 weights = real4(0.0);
  weights[corners.x] = point.weights.x;
  weights[corners.y] = point.weights.y;
  weights[corners.z] = point.weights.z;
  return weights;
}

// The distance of the origin from a face of a tetrahedron, on the side of the fourth corner; not above 0: the
// face separates the origin from that corner. So does each face of a tetrahedron that is so flat that
// rounding decides on which side the corner is. `error`: bound of the rounding; large for thin faces.
real height_above(Simplex s, uvec3 corners, uint fourth, out real error) {
  const real3 a = s.w[corners.x];
  const real3 d = s.w[fourth];
  const real3 ab = s.w[corners.y] - a;
  const real3 ac = s.w[corners.z] - a;
  const real3 n = cross(ab, ac);
  const real height = dot(n, d - a);
  const real per_length = real(8.0) * real_epsilon * length(ab) * length(ac);
  const real origin = height < real(0.0) ? dot(n, a) : -dot(n, a);
  const real area = max(length(n), real_tiny);
  error = per_length * length(a) / area;
  return abs(height) > per_length * (length(a) + length(d)) ? origin / area : real(0.0);
}

NearestOfSimplex nearest_of(Simplex s) {
  if (s.count == 1u)
    return NearestOfSimplex(real4(1.0, 0.0, 0.0, 0.0), dot(s.w[0], s.w[0]), false, real(0.0));
  if (s.count == 2u) {
    real along;
    const real3 point = nearest_of_edge(s.w[0], s.w[1], along);
    return NearestOfSimplex(real4(real(1.0) - along, along, 0.0, 0.0), dot(point, point), false, real(0.0));
  }
  if (s.count == 3u) {
    const NearestOfTriangle point = nearest_of_triangle(s.w[0], s.w[1], s.w[2]);
    return NearestOfSimplex(weights_of(point, uvec3(0, 1, 2)), point.square, false, real(0.0));
  }
  NearestOfSimplex best = NearestOfSimplex(real4(0.0), real_max, true, real_max);
  const uvec3 faces[4] = uvec3[](uvec3(0, 1, 2), uvec3(0, 1, 3), uvec3(0, 2, 3), uvec3(1, 2, 3));
  const uint fourths[4] = uint[](3u, 2u, 1u, 0u);
  [[unroll]] for (uint i = 0u; i < 4u; ++i) {
    const NearestOfTriangle point = nearest_of_triangle(s.w[faces[i].x], s.w[faces[i].y], s.w[faces[i].z]);
    real error;
    const real height = height_above(s, faces[i], fourths[i], error);
    const bool separates = !(height > real(0.0));
    const bool is_better = separates && point.square < best.square;
    best.weights = is_better ? weights_of(point, faces[i]) : best.weights;
    best.square = is_better ? point.square : best.square;
    best.holds_origin = best.holds_origin && !separates;
    best.inside = min(best.inside, max(height - error, real_tiny));
  }
  return best;
}

// Removes the points that the nearest one does not depend on.
void reduce(inout Simplex s, real4 weights) {
  uint kept = 0u;
  real4 kept_weights = real4(0.0);
  [[unroll]] for (uint i = 0u; i < 4u; ++i) {
    const bool keeps = i < s.count && weights[i] > real(0.0);
    if (keeps) {
      s.w[kept] = s.w[i];
      s.a[kept] = s.a[i];
      kept_weights[kept] = weights[i];
      ++kept;
    }
  }
  s.weights = kept_weights;
  s.count = kept;
}

// The unit direction from the origin to the nearest point v. Rounding turns v by the error of its coordinates
// over its length, and the normal of a triangle by that error over its least height. The smaller turn is
// taken.
real3 direction_to(Simplex s, real3 v) {
  real3 d = v;
  const real square = dot(v, v);
  const real3 ab = s.w[1] - s.w[0];
  if (s.count == 3u) {
    const real3 ac = s.w[2] - s.w[0];
    const real3 bc = ac - ab;
    const real3 n = cross(ab, ac);
    const real longest = max(max(dot(ab, ab), dot(ac, ac)), dot(bc, bc));
    if (dot(n, n) > square * longest) d = dot(n, v) < real(0.0) ? -n : n;
  } else if (s.count == 2u && dot(ab, ab) > square) {
    d = v - dot(v, ab) / dot(ab, ab) * ab;
  }
  return d / max(length(d), real_tiny);
}

void nearest_points(Simplex s, out real3 v, out real3 a) {
  v = real3(0.0);
  a = real3(0.0);
  [[unroll]] for (uint i = 0u; i < 4u; ++i) {
    if (i < s.count) {
      v += s.weights[i] * s.w[i];
      a += s.weights[i] * s.a[i];
    }
  }
}

#endif
