// The shortest segment between two triangles, or a point at which they cross. Lengths are in metres.
#ifndef RTSTDB_QUERY_CONTACT_TRIANGLE_PAIR_GLSL
#define RTSTDB_QUERY_CONTACT_TRIANGLE_PAIR_GLSL

struct TriangleGap {
  float square;  // of the distance
  vec3 first;    // point of the first triangle
  vec3 second;   // point of the second
};

void take_nearer(vec3 first, vec3 second, inout TriangleGap gap) {
  const vec3 between = first - second;
  const float square = dot(between, between);
  const bool nearer = square < gap.square;
  gap.square = nearer ? square : gap.square;
  gap.first = nearer ? first : gap.first;
  gap.second = nearer ? second : gap.second;
}

// The nearest points of two edges (Ericson, Real-Time Collision Detection, 2005, 5.1.9).
void take_edges(vec3 p, vec3 p_edge, vec3 q, vec3 q_edge, inout TriangleGap gap) {
  const vec3 r = p - q;
  const float a = max(dot(p_edge, p_edge), 1e-37);
  const float e = max(dot(q_edge, q_edge), 1e-37);
  const float b = dot(p_edge, q_edge);
  const float c = dot(p_edge, r);
  const float f = dot(q_edge, r);
  const float denominator = a * e - b * b;
  // For parallel edges the search may start at any point of the first one.
  float s = denominator > 1e-6 * a * e ? clamp((b * f - c * e) / denominator, 0.0, 1.0) : 0.0;
  const float t = clamp((b * s + f) / e, 0.0, 1.0);
  s = clamp((b * t - c) / a, 0.0, 1.0);
  take_nearer(p + s * p_edge, q + t * q_edge, gap);
}

// A corner and the foot of its perpendicular in the other triangle: `a` is a corner of that triangle, `ab`
// and `ac` are its edges, `n` is their cross product.
void take_corner(vec3 corner, vec3 a, vec3 ab, vec3 ac, vec3 n, bool corner_is_first, inout TriangleGap gap) {
  const float nn = max(dot(n, n), 1e-37);
  const vec3 w = corner - a;
  const float u = dot(cross(w, ac), n) / nn;
  const float v = dot(cross(ab, w), n) / nn;
  if (u < 0.0 || v < 0.0 || u + v > 1.0) return;
  const vec3 foot = a + u * ab + v * ac;
  take_nearer(corner_is_first ? corner : foot, corner_is_first ? foot : corner, gap);
}

// Adds the point at which an edge passes through a triangle, if it does, to `crossings`: the sum of the
// points and, in w, their number.
void add_crossing(vec3 from, vec3 to, vec3 a, vec3 ab, vec3 ac, vec3 n, inout vec4 crossings) {
  const float from_height = dot(n, from - a);
  const float to_height = dot(n, to - a);
  if (!(from_height * to_height <= 0.0) || from_height == to_height) return;
  const vec3 point = mix(from, to, from_height / (from_height - to_height));
  const vec3 w = point - a;
  const float nn = max(dot(n, n), 1e-37);
  const float u = dot(cross(w, ac), n) / nn;
  const float v = dot(cross(ab, w), n) / nn;
  if (u >= 0.0 && v >= 0.0 && u + v <= 1.0) crossings += vec4(point, 1.0);
}

// Of triangles that cross, both points are the mean of the points at which edges pass through the other
// triangle. Positions are relative to a point near the triangles, for precision.
TriangleGap gap_between(Triangle first, Triangle second) {
  const vec3 p[3] = {first.a, first.b, first.c};
  const vec3 q[3] = {second.a, second.b, second.c};
  const vec3 p_ab = p[1] - p[0];
  const vec3 p_ac = p[2] - p[0];
  const vec3 q_ab = q[1] - q[0];
  const vec3 q_ac = q[2] - q[0];
  const vec3 p_n = cross(p_ab, p_ac);
  const vec3 q_n = cross(q_ab, q_ac);
  vec4 crossings = vec4(0.0);
  TriangleGap gap = TriangleGap(3.4e38, p[0], q[0]);
  [[unroll]] for (uint i = 0u; i < 3u; ++i) {
    const uint next = (i + 1u) % 3u;
    add_crossing(p[i], p[next], q[0], q_ab, q_ac, q_n, crossings);
    add_crossing(q[i], q[next], p[0], p_ab, p_ac, p_n, crossings);
    take_corner(p[i], q[0], q_ab, q_ac, q_n, true, gap);
    take_corner(q[i], p[0], p_ab, p_ac, p_n, false, gap);
    [[unroll]] for (uint j = 0u; j < 3u; ++j)
        take_edges(p[i], p[next] - p[i], q[j], q[(j + 1u) % 3u] - q[j], gap);
  }
  if (crossings.w > 0.0) {
    const vec3 middle = crossings.xyz / crossings.w;
    gap = TriangleGap(0.0, middle, middle);
  }
  return gap;
}

#endif
