// How triangles lie to boxes and spheres. Corners are given in the region's own frame: seen from its centre, along its axes.
#ifndef RTSTDB_QUERY_TRIANGLE_IN_SOLID_GLSL
#define RTSTDB_QUERY_TRIANGLE_IN_SOLID_GLSL
#include "query/nearest_on_triangle.glsl"
#include "query/region_solid.glsl"
#include "query/triangle_plane.glsl"

// The directions that are square to an edge and to one of the box's axes, all three at once. `on` lies on the edge, `off` is
// the corner across. Components along the axis drop out, so that rounding stays in proportion to the direction's length, also
// where edge and axis are nearly parallel; where they are, the direction is null and tells nothing apart.
bool edge_is_apart(vec3 half_extent, vec3 edge, vec3 on, vec3 off) {
  const vec3 s0 = edge.zxy * on.yzx - edge.yzx * on.zxy;
  const vec3 s1 = edge.zxy * off.yzx - edge.yzx * off.zxy;
  const vec3 reach = abs(edge.zxy) * half_extent.yzx + abs(edge.yzx) * half_extent.zxy;
  return any(greaterThan(max(min(s0, s1), -max(s0, s1)), reach));
}

// Separating axes of a box and a triangle (Akenine-Moeller 2001). Touching counts.
bool box_touches(vec3 half_extent, vec3 a, vec3 b, vec3 c) {
  const vec3 lo = min(a, min(b, c));
  const vec3 hi = max(a, max(b, c));
  const bool apart = any(greaterThan(max(lo, -hi), half_extent));
  const bool apart_ab = edge_is_apart(half_extent, b - a, a, c);
  const bool apart_bc = edge_is_apart(half_extent, c - b, b, a);
  const bool apart_ca = edge_is_apart(half_extent, a - c, c, b);
  const vec3 normal = cross(b - a, c - a);
  float beyond = abs(dot(normal, a)) - dot(abs(normal), half_extent);
  if (abs(beyond) <= plane_doubt(a, b, c, half_extent)) {
    const dvec3 exact = exact_normal(a, b, c);
    beyond = float(abs(dot(exact, dvec3(a))) - dot(abs(exact), dvec3(half_extent)));
  }
  return !(apart || apart_ab || apart_bc || apart_ca) && beyond <= 0.0;
}

bool holds_triangle(Shape shape, vec3 a, vec3 b, vec3 c) {
  const vec3 half_extent = shape.box.half_extent;
  const float square = half_extent.x * half_extent.x;
  const bool corners_in_sphere = max(dot(a, a), max(dot(b, b), dot(c, c))) <= square;
  const bool corners_in_box = all(lessThanEqual(max(abs(a), max(abs(b), abs(c))), half_extent));
  const bool touches_sphere = nearest_on_triangle(a, b, c).square <= square;
  const bool touches_box = box_touches(half_extent, a, b, c);
  return shape.is_sphere ? (shape.wants_inside ? corners_in_sphere : touches_sphere)
                         : (shape.wants_inside ? corners_in_box : touches_box);
}

#endif
