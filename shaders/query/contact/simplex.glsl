// The point of a simplex of one to four points that is nearest to the origin.
#ifndef RTSTDB_QUERY_CONTACT_SIMPLEX_GLSL
#define RTSTDB_QUERY_CONTACT_SIMPLEX_GLSL
#include "query/nearest_on_triangle.glsl"

struct Simplex {
  vec3 w[4];
  vec3 a[4];  // see Difference
  vec4 weights;
  uint count;
};

struct NearestOfSimplex {
  vec4 weights;
  float square;
  bool holds_origin;
};

vec4 weights_of(TrianglePoint point, uvec3 corners) {
  vec4 weights = vec4(0.0);
  weights[corners.x] = 1.0 - point.u - point.v;
  weights[corners.y] = point.u;
  weights[corners.z] = point.v;
  return weights;
}

NearestOfSimplex nearest_of_face(Simplex s, uvec3 corners) {
  const TrianglePoint point = nearest_on_triangle(s.w[corners.x], s.w[corners.y], s.w[corners.z]);
  return NearestOfSimplex(weights_of(point, corners), point.square, false);
}

// Whether a face of a tetrahedron separates its fourth corner from the origin. So does each face of a
// tetrahedron that is so flat that rounding decides on which side the corner is.
bool separates(Simplex s, uvec3 corners, uint fourth) {
  const vec3 a = s.w[corners.x];
  const vec3 d = s.w[fourth];
  const vec3 n = cross(s.w[corners.y] - a, s.w[corners.z] - a);
  const float height = dot(n, d - a);
  const float rounding = 1e-6 * length(n) * (length(a) + length(d));
  return abs(height) <= rounding || dot(n, -a) * height <= 0.0;
}

NearestOfSimplex nearest_of(Simplex s) {
  if (s.count == 1u) return NearestOfSimplex(vec4(1.0, 0.0, 0.0, 0.0), dot(s.w[0], s.w[0]), false);
  if (s.count == 2u) {
    vec3 offset;
    float along;
    nearest_on_edge(s.w[0], s.w[1], offset, along);
    return NearestOfSimplex(vec4(1.0 - along, along, 0.0, 0.0), dot(offset, offset), false);
  }
  if (s.count == 3u) return nearest_of_face(s, uvec3(0, 1, 2));
  NearestOfSimplex best = NearestOfSimplex(vec4(0.0), 3.4e38, true);
  const uvec3 faces[4] = uvec3[](uvec3(0, 1, 2), uvec3(0, 1, 3), uvec3(0, 2, 3), uvec3(1, 2, 3));
  const uint fourths[4] = uint[](3u, 2u, 1u, 0u);
  [[unroll]] for (uint i = 0u; i < 4u; ++i) {
    const NearestOfSimplex of_face = nearest_of_face(s, faces[i]);
    const bool is_better = separates(s, faces[i], fourths[i]) && of_face.square < best.square;
    best.weights = is_better ? of_face.weights : best.weights;
    best.square = is_better ? of_face.square : best.square;
    best.holds_origin = best.holds_origin && !separates(s, faces[i], fourths[i]);
  }
  return best;
}

// Removes the points that the nearest one does not depend on.
void reduce(inout Simplex s, vec4 weights) {
  uint kept = 0u;
  vec4 kept_weights = vec4(0.0);
  [[unroll]] for (uint i = 0u; i < 4u; ++i) {
    const bool keeps = i < s.count && weights[i] > 0.0;
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

// The unit direction from the origin to the nearest point v. Where the simplex is much larger than its
// distance, rounding of its corners turns v, but hardly the normal of its triangle or edge.
vec3 direction_to(Simplex s, vec3 v) {
  vec3 d = v;
  const vec3 ab = s.w[1] - s.w[0];
  if (dot(v, v) < 1e-6 * dot(s.w[0], s.w[0])) {
    if (s.count == 3u) {
      const vec3 n = cross(ab, s.w[2] - s.w[0]);
      d = dot(n, n) > 0.0 ? (dot(n, v) < 0.0 ? -n : n) : v;
    } else if (s.count == 2u) {
      d = v - dot(v, ab) / dot(ab, ab) * ab;
    }
  }
  return d / max(length(d), 1e-37);
}

void nearest_points(Simplex s, out vec3 v, out vec3 a) {
  v = vec3(0.0);
  a = vec3(0.0);
  [[unroll]] for (uint i = 0u; i < 4u; ++i) {
    if (i < s.count) {
      v += s.weights[i] * s.w[i];
      a += s.weights[i] * s.a[i];
    }
  }
}

#endif
