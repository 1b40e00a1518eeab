// The plane of a triangle. Single precision does not give the normal of a sliver, so where a body is nearer
// to the plane than plane_doubt, the test is repeated in double precision.
#ifndef RTSTDB_QUERY_REGION_TRIANGLE_PLANE_GLSL
#define RTSTDB_QUERY_REGION_TRIANGLE_PLANE_GLSL

float sum_of_sizes(vec3 p) { return abs(p.x) + abs(p.y) + abs(p.z); }

// The rounding error of the normal's dot product with points as far from the origin as the corners and
// `reach`.
float plane_doubt(vec3 a, vec3 b, vec3 c, vec3 reach) {
  return 2e-6 * sum_of_sizes(b - a) * sum_of_sizes(c - a) * (sum_of_sizes(a) + sum_of_sizes(reach));
}

dvec3 exact_normal(vec3 a, vec3 b, vec3 c) { return cross(dvec3(b) - dvec3(a), dvec3(c) - dvec3(a)); }

#endif
