// Tests of triangles against frusta. Corners are in the frustum's frame: relative to its eye, looking along
// x.
#ifndef RTSTDB_QUERY_REGION_TRIANGLE_IN_FRUSTUM_GLSL
#define RTSTDB_QUERY_REGION_TRIANGLE_IN_FRUSTUM_GLSL
#include "query/region/frustum.glsl"
#include "query/region/triangle_plane.glsl"

// The depth of a point inside each of the four sides, each in its own unit.
vec4 before_sides(Shape shape, vec3 p) {
  const vec2 half_view = shape.opening * p.x;
  return vec4(half_view.x + p.y, half_view.x - p.y, half_view.y + p.z, half_view.y - p.z);
}

// Whether the interval between s0 and s1 lies outside of [low, high].
bvec4 beyond(vec4 s0, vec4 s1, vec4 low, vec4 high) {
  return greaterThan(max(min(s0, s1) - high, low - max(s0, s1)), vec4(0.0));
}

// The separating axes that are perpendicular to an edge of the triangle and to one of the frustum. `on` lies
// on the edge, `off` is the opposite corner. Along one of the four slanted edges, the frustum is a rectangle
// whose coordinates are the depths of its sides, so the rounding error is proportional to the length of the
// axis, also where both edges are nearly parallel.
bool edge_is_apart(Shape shape, vec3 edge, vec3 on, vec3 off, vec4 edge_sides, vec4 on_sides,
                   vec4 off_sides) {
  const vec2 widest = 2.0 * shape.far * shape.opening;
  const vec4 u = edge_sides.xyxy;
  const vec4 w = edge_sides.zzww;
  const vec4 along_u = w * widest.x;
  const vec4 along_w = -u * widest.y;
  const bvec4 slanted = beyond(w * on_sides.xyxy - u * on_sides.zzww, w * off_sides.xyxy - u * off_sides.zzww,
                               min(along_u, 0.0) + min(along_w, 0.0), max(along_u, 0.0) + max(along_w, 0.0));
  const vec2 across_y = frustum_span(shape, vec3(-edge.z, 0.0, edge.x));
  const vec2 across_z = frustum_span(shape, vec3(edge.y, -edge.x, 0.0));
  const vec2 s0 = vec2(edge.x * on.z - edge.z * on.x, edge.y * on.x - edge.x * on.y);
  const vec2 s1 = vec2(edge.x * off.z - edge.z * off.x, edge.y * off.x - edge.x * off.y);
  const bvec4 upright = beyond(s0.xyxy, s1.xyxy, vec4(across_y.x, across_z.x, across_y.x, across_z.x),
                               vec4(across_y.y, across_z.y, across_y.y, across_z.y));
  return any(slanted) || any(upright);
}

// The distance of the triangle's plane from the frustum, times the normal's length; not above zero where they
// meet.
float plane_gap(Shape shape, vec3 normal, float at) {
  const vec2 span = frustum_span(shape, normal);
  return max(at - span.y, span.x - at);
}

double exact_plane_gap(Shape shape, vec3 a, vec3 b, vec3 c) {
  const dvec3 normal = exact_normal(a, b, c);
  const double at = dot(normal, dvec3(a));
  const double aside = dot(abs(normal.yz), dvec2(shape.opening));
  const dvec2 near = double(shape.near) * dvec2(normal.x - aside, normal.x + aside);
  const dvec2 far = double(shape.far) * dvec2(normal.x - aside, normal.x + aside);
  return max(at - max(near.y, far.y), min(near.x, far.x) - at);
}

ChildMasks children_near(PackedNode node, Shape shape, mat3 axes) { return children_of(node, shape); }

bool holds_triangle(Shape shape, vec3 a, vec3 b, vec3 c) {
  const vec4 a_sides = before_sides(shape, a);
  const vec4 b_sides = before_sides(shape, b);
  const vec4 c_sides = before_sides(shape, c);
  const float nearest = min(a.x, min(b.x, c.x));
  const float farthest = max(a.x, max(b.x, c.x));
  const bool inside = nearest >= shape.near && farthest <= shape.far &&
                      all(greaterThanEqual(min(a_sides, min(b_sides, c_sides)), vec4(0.0)));
  const bool apart = nearest > shape.far || farthest < shape.near ||
                     any(lessThan(max(a_sides, max(b_sides, c_sides)), vec4(0.0)));
  const bool apart_ab = edge_is_apart(shape, b - a, a, c, b_sides - a_sides, a_sides, c_sides);
  const bool apart_bc = edge_is_apart(shape, c - b, b, a, c_sides - b_sides, b_sides, a_sides);
  const bool apart_ca = edge_is_apart(shape, a - c, c, b, a_sides - c_sides, c_sides, b_sides);
  const vec3 normal = cross(b - a, c - a);
  float gap = plane_gap(shape, normal, dot(normal, a));
  const vec3 reach = shape.far * vec3(1.0, shape.opening);
  if (abs(gap) <= plane_doubt(a, b, c, reach)) gap = float(exact_plane_gap(shape, a, b, c));
  return shape.wants_inside ? inside : !(apart || apart_ab || apart_bc || apart_ca) && gap <= 0.0;
}

#endif
