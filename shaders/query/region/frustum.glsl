// Frusta as regions, and their tests against oriented boxes. In its own frame a frustum looks along x from
// the origin.
#ifndef RTSTDB_QUERY_REGION_FRUSTUM_GLSL
#define RTSTDB_QUERY_REGION_FRUSTUM_GLSL
#include "common/packed_edges.glsl"
#include "query/region/region_shape.glsl"

struct Shape {
  vec3 eye;
  vec4 q;
  float near;
  float far;
  vec2 opening;  // half width and half height at a distance of one
  bool wants_inside;
  Box outer;       // contains it
  vec4 planes[6];  // normals to the inside, and the distance of the origin
};

// The smallest and the largest value of dot(axis, p) over the frustum, in its own frame. They occur at
// corners, which lie at the near and the far distance along four edges.
vec2 frustum_span(Shape shape, vec3 axis) {
  const float aside = dot(abs(axis.yz), shape.opening);
  const float low = axis.x - aside;
  const float high = axis.x + aside;
  return vec2(min(shape.near * low, shape.far * low), max(shape.near * high, shape.far * high));
}

// `at`: the pose of the frustum's frame.
Shape shape_of(OrientedBox at, RegionRecord record) {
  Shape shape;
  shape.eye = at.center;
  shape.q = at.q;
  shape.near = record.near_m;
  shape.far = record.half_extent_m.x;
  shape.opening = record.half_extent_m.yz / shape.far;
  shape.wants_inside = (record.flags & region_wants_inside) != 0u;
  const mat3 r = axes_of(at.q);
  const vec2 x = frustum_span(shape, vec3(r[0].x, r[1].x, r[2].x));
  const vec2 y = frustum_span(shape, vec3(r[0].y, r[1].y, r[2].y));
  const vec2 z = frustum_span(shape, vec3(r[0].z, r[1].z, r[2].z));
  const vec3 slop = 1e-6 * (abs(at.center) + length(record.half_extent_m));
  shape.outer = Box(at.center + vec3(x.x, y.x, z.x) - slop, at.center + vec3(x.y, y.y, z.y) + slop);
  const vec2 steep = inversesqrt(1.0 + shape.opening * shape.opening);
  const vec3 normals[6] = vec3[](
      r[0], -r[0], steep.x * (shape.opening.x * r[0] + r[1]), steep.x * (shape.opening.x * r[0] - r[1]),
      steep.y * (shape.opening.y * r[0] + r[2]), steep.y * (shape.opening.y * r[0] - r[2]));
  [[unroll]] for (int k = 0; k < 6; ++k) {
    const float beyond = k == 0 ? -shape.near : k == 1 ? shape.far : 0.0;
    shape.planes[k] = vec4(normals[k], beyond - dot(normals[k], at.center));
  }
  return shape;
}

// A box beyond one of the planes does not meet the frustum; a box inside all of them lies within.
ChildMasks children_of(PackedNode node, Shape shape) {
  float sure[8];
  float possible[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) sure[k] = possible[k] = 3.4e38;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    vec3 lo;
    vec3 hi;
    [[unroll]] for (int axis = 0; axis < 3; ++axis) {
      lo[axis] = float(int(node.edges[axis][k >> 2] >> 8u * (k & 3u) & 0xFFu)) - node.above;
      hi[axis] = float(int(node.edges[axis][2u + (k >> 2)] >> 8u * (k & 3u) & 0xFFu)) + node.below;
    }
    const vec3 quantum = 1.0 / node.per_quantum;
    const vec3 center = node.origin + 0.5 * quantum * (lo + hi);
    const vec3 half_extent = 0.5 * quantum * abs(hi - lo) + node.overhang;
    const float slop = 2e-6 * (length(center) + length(half_extent) + length(shape.eye) + shape.far);
    [[unroll]] for (int plane = 0; plane < 6; ++plane) {
      const float distance = dot(shape.planes[plane].xyz, center) + shape.planes[plane].w;
      const float reach = dot(abs(shape.planes[plane].xyz), half_extent) + slop;
      sure[k] = min(sure[k], distance - reach);
      possible[k] = min(possible[k], distance + reach);
    }
  }
  ChildMasks masks = ChildMasks(0u, 0u);
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    masks.meeting |= possible[k] >= 0.0 ? 1u << k : 0u;
    masks.within |= sure[k] >= 0.0 ? 1u << k : 0u;
  }
  masks.meeting &= children_meeting(node, shape.outer.lo, shape.outer.hi);
  masks.within &= node.used;
  return masks;
}

// Separating axis test of two convex bodies: face normals and cross products of edges. Touching counts.
// Inside: no corner of b lies beyond a face.
bool holds(Shape shape, OrientedBox b) {
  const vec4 to_own = conjugate(shape.q);
  const vec3 t = rotate(to_own, b.center - shape.eye);
  const mat3 r = axes_of(quat_product(to_own, b.q));
  // Parallel edges give null axes, which separate nothing; the slack covers their rounding.
  const float slack =
      3e-7 * (length(t) + length(b.half_extent) + shape.far * (1.0 + shape.opening.x + shape.opening.y));
  const vec3 faces[5] =
      vec3[](vec3(1.0, 0.0, 0.0), vec3(shape.opening.x, 1.0, 0.0), vec3(shape.opening.x, -1.0, 0.0),
             vec3(shape.opening.y, 0.0, 1.0), vec3(shape.opening.y, 0.0, -1.0));
  bool apart = false;
  bool inside = true;
  [[unroll]] for (int k = 0; k < 5; ++k) {
    const float at = dot(faces[k], t);
    const float reach = dot(abs(faces[k] * r), b.half_extent);
    const vec2 span = frustum_span(shape, faces[k]);
    apart = apart || at - reach > span.y || at + reach < span.x;
    // For the sides, only the lower end of the span is a face.
    inside = inside && at - reach >= (k == 0 ? shape.near : 0.0) && (k != 0 || at + reach <= shape.far);
  }
  const vec3 edges[6] =
      vec3[](vec3(0.0, 1.0, 0.0), vec3(0.0, 0.0, 1.0), normalize(vec3(1.0, shape.opening)),
             normalize(vec3(1.0, shape.opening.x, -shape.opening.y)),
             normalize(vec3(1.0, -shape.opening.x, shape.opening.y)), normalize(vec3(1.0, -shape.opening)));
  [[unroll]] for (int j = 0; j < 3; ++j) {
    const vec2 span = frustum_span(shape, r[j]);
    const float at = dot(r[j], t);
    apart = apart || at - b.half_extent[j] > span.y || at + b.half_extent[j] < span.x;
    [[unroll]] for (int k = 0; k < 6; ++k) {
      const vec3 axis = cross(edges[k], r[j]);
      const float along = dot(axis, t);
      const float reach = dot(abs(axis * r), b.half_extent) + slack;
      const vec2 across = frustum_span(shape, axis);
      apart = apart || along - reach > across.y || along + reach < across.x;
    }
  }
  return shape.wants_inside ? inside : !apart;
}

#endif
