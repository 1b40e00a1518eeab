// Tests of triangles against spheres. Corners are relative to the sphere's centre.
#ifndef RTSTDB_QUERY_REGION_TRIANGLE_IN_SPHERE_GLSL
#define RTSTDB_QUERY_REGION_TRIANGLE_IN_SPHERE_GLSL
#include "query/nearest_on_triangle.glsl"
#include "query/region/box_or_sphere.glsl"

bool holds_triangle(Shape shape, vec3 a, vec3 b, vec3 c) {
  const float radius = shape.box.half_extent.x;
  const float square =
      shape.wants_inside ? max(dot(a, a), max(dot(b, b), dot(c, c))) : nearest_on_triangle(a, b, c).square;
  return square <= radius * radius;
}

// Tests the nearest and the farthest point of each child's box.
ChildMasks children_near(PackedNode node, Shape shape, mat3 axes) {
  ChildMasks masks = children_of(node, shape);
  const float radius = shape.box.half_extent.x;
  const vec3 half_quantum = 0.5 / node.per_quantum;
  const vec3 offset = node.origin - shape.box.center;
  const vec3 slop = 2e-6 * (abs(node.origin) + abs(shape.box.center) + vec3(radius));
  uint meeting = 0u;
  uint within = 0u;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    vec3 lo;
    vec3 hi;
    [[unroll]] for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = float(int(node.edges[axis][k >> 2] >> 8u * (k & 3u) & 0xFFu));
      hi[axis] = float(int(node.edges[axis][2u + (k >> 2)] >> 8u * (k & 3u) & 0xFFu));
    }
    const vec3 away = abs(half_quantum * (lo + hi) + offset);
    const vec3 reach = half_quantum * (hi - lo) + slop;
    const vec3 nearest = max(away - reach, vec3(0.0));
    const vec3 farthest = away + reach;
    meeting |= dot(nearest, nearest) <= radius * radius ? 1u << k : 0u;
    within |= dot(farthest, farthest) <= radius * radius ? 1u << k : 0u;
  }
  masks.meeting &= meeting;
  masks.within = (masks.within | within) & masks.meeting;
  return masks;
}

#endif
