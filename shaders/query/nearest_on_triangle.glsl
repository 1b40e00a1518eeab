// The nearest point of a triangle.
#ifndef RTSTDB_QUERY_NEAREST_ON_TRIANGLE_GLSL
#define RTSTDB_QUERY_NEAREST_ON_TRIANGLE_GLSL

struct TrianglePoint {
  vec3 offset;  // from the query point
  float square;
  float u;
  float v;
};

float exact_dot(vec3 a, vec3 b) {
  precise float product = a.x * b.x + a.y * b.y + a.z * b.z;
  return product;
}

// The nearest point on the edge from a to b, relative to the query point; `along`: the weight of b. The
// computation starts from the nearer end, so both triangles of an edge find the same point to the last bit.
void nearest_on_edge(vec3 a, vec3 b, out vec3 offset, out float along) {
  const bool turned = exact_dot(b, b) < exact_dot(a, a);
  const vec3 from = turned ? b : a;
  precise vec3 edge = (turned ? a : b) - from;
  const float share = clamp(-exact_dot(from, edge) / max(exact_dot(edge, edge), 1e-37), 0.0, 1.0);
  precise vec3 point = from + share * edge;
  offset = point;
  along = turned ? 1.0 - share : share;
}

// The nearest point of the three edges and of the face, where the perpendicular foot lies inside the
// triangle. So the result is a point of the triangle, even for a sliver. Classifying Voronoi regions
// (Ericson, Real-Time Collision Detection, 2005, 5.1.5) saves nothing where branches are masked. Corners are
// relative to the query point.
TrianglePoint nearest_on_triangle(vec3 a, vec3 b, vec3 c) {
  vec3 on_ab, on_ac, on_bc;
  float along_ab, along_ac, along_bc;
  nearest_on_edge(a, b, on_ab, along_ab);
  nearest_on_edge(a, c, on_ac, along_ac);
  nearest_on_edge(b, c, on_bc, along_bc);
  TrianglePoint best = TrianglePoint(on_ab, exact_dot(on_ab, on_ab), along_ab, 0.0);
  const float ac_square = exact_dot(on_ac, on_ac);
  const bool ac_nearer = ac_square < best.square;
  best.offset = ac_nearer ? on_ac : best.offset;
  best.square = ac_nearer ? ac_square : best.square;
  best.u = ac_nearer ? 0.0 : best.u;
  best.v = ac_nearer ? along_ac : best.v;
  const float bc_square = exact_dot(on_bc, on_bc);
  const bool bc_nearer = bc_square < best.square;
  best.offset = bc_nearer ? on_bc : best.offset;
  best.square = bc_nearer ? bc_square : best.square;
  best.u = bc_nearer ? 1.0 - along_bc : best.u;
  best.v = bc_nearer ? along_bc : best.v;
  const vec3 ab = b - a;
  const vec3 ac = c - a;
  const vec3 n = cross(ab, ac);
  const float nn = dot(n, n);
  const float share = 1.0 / max(nn, 1e-37);
  const float u = dot(cross(ac, a), n) * share;
  const float v = dot(cross(a, ab), n) * share;
  const vec3 foot = a + u * ab + v * ac;
  const float foot_square = dot(foot, foot);
  const bool foot_nearer = u > 0.0 && v > 0.0 && u + v < 1.0 && foot_square < best.square;
  best.offset = foot_nearer ? foot : best.offset;
  best.square = foot_nearer ? foot_square : best.square;
  best.u = foot_nearer ? u : best.u;
  best.v = foot_nearer ? v : best.v;
  return best;
}

#endif
