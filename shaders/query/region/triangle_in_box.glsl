// Tests of triangles against boxes. Corners are in the box's frame: relative to its centre, along its axes.
#ifndef RTSTDB_QUERY_REGION_TRIANGLE_IN_BOX_GLSL
#define RTSTDB_QUERY_REGION_TRIANGLE_IN_BOX_GLSL
#include "query/region/box_or_sphere.glsl"
#include "query/region/triangle_plane.glsl"

// The separating axes that are perpendicular to an edge and to one of the box's axes, all three at once. `on`
// lies on the edge, `off` is the opposite corner. Components along the box's axis cancel exactly, so the
// rounding error is proportional to the length of the separating axis, also where edge and axis are nearly
// parallel; a null axis separates nothing.
bool edge_is_apart(vec3 half_extent, vec3 edge, vec3 on, vec3 off) {
  const vec3 s0 = edge.zxy * on.yzx - edge.yzx * on.zxy;
  const vec3 s1 = edge.zxy * off.yzx - edge.yzx * off.zxy;
  const vec3 reach = abs(edge.zxy) * half_extent.yzx + abs(edge.yzx) * half_extent.zxy;
  return any(greaterThan(max(min(s0, s1), -max(s0, s1)), reach));
}

// Separating axis test of a box and a triangle (Akenine-Moeller 2001). Touching counts.
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
  const bool inside = all(lessThanEqual(max(abs(a), max(abs(b), abs(c))), half_extent));
  return shape.wants_inside ? inside : box_touches(half_extent, a, b, c);
}

// Tests children along the region's axes too, so that children beside a rotated box are skipped. `axes`: of
// the box.
ChildMasks children_near(PackedNode node, Shape shape, mat3 axes) {
  ChildMasks masks = children_of(node, shape);
  const vec3 half_extent = shape.box.half_extent;
  const vec3 half_quantum = 0.5 / node.per_quantum;
  const vec3 from_center = node.origin - shape.box.center;
  const vec3 slop =
      2e-6 * vec3(sum_of_sizes(node.origin) + sum_of_sizes(shape.box.center) + sum_of_sizes(half_extent));
  // One row for each axis of the box: the length along it of a quantum along each axis of the entity.
  const mat3 worth = transpose(mat3(axes[0] * half_quantum, axes[1] * half_quantum, axes[2] * half_quantum));
  const mat3 reach_worth = mat3(abs(worth[0]), abs(worth[1]), abs(worth[2]));
  const vec3 offset = from_center * axes;
  uint meeting = 0u;
  uint within = 0u;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    vec3 lo;
    vec3 hi;
    [[unroll]] for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = float(int(node.edges[axis][k >> 2] >> 8u * (k & 3u) & 0xFFu));
      hi[axis] = float(int(node.edges[axis][2u + (k >> 2)] >> 8u * (k & 3u) & 0xFFu));
    }
    const vec3 away = abs(worth * (lo + hi) + offset);
    const vec3 reach = reach_worth * (hi - lo) + slop;
    meeting |= all(lessThanEqual(away, half_extent + reach)) ? 1u << k : 0u;
    within |= all(lessThanEqual(away + reach, half_extent)) ? 1u << k : 0u;
  }
  masks.meeting &= meeting;
  masks.within = (masks.within | within) & masks.meeting;
  return masks;
}

#endif
