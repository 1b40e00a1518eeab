// Boxes and spheres as regions, and their tests against oriented boxes.
#ifndef RTSTDB_QUERY_REGION_BOX_OR_SPHERE_GLSL
#define RTSTDB_QUERY_REGION_BOX_OR_SPHERE_GLSL
#include "common/packed_edges.glsl"
#include "query/region/region_shape.glsl"

struct Shape {
  OrientedBox box;  // of a sphere, half_extent.x is the radius
  bool is_sphere;
  bool wants_inside;
  Box outer;  // contains it
  Box inner;  // lies in it; inside out where no such box is known
};

// `at`: the pose of the region.
Shape shape_of(OrientedBox at, RegionRecord record) {
  Shape shape;
  shape.is_sphere = (record.flags & region_is_sphere) != 0u;
  shape.wants_inside = (record.flags & region_wants_inside) != 0u;
  shape.box = at;
  const mat3 r = axes_of(shape.box.q);
  const mat3 s = mat3(abs(r[0]), abs(r[1]), abs(r[2]));
  const float radius = shape.box.half_extent.x;
  const vec3 reach = shape.is_sphere ? vec3(radius) : s * shape.box.half_extent;
  // An axis-aligned box inside the region: all of an axis-aligned region, a part of others.
  const vec3 fits = shape.box.half_extent / max(reach * s, vec3(1e-30));
  const vec3 inner_reach = shape.is_sphere ? vec3(0.577 * radius) : reach * min(fits.x, min(fits.y, fits.z));
  const vec3 slop = 1e-6 * (abs(shape.box.center) + reach);
  shape.outer = Box(shape.box.center - reach - slop, shape.box.center + reach + slop);
  shape.inner = Box(shape.box.center - inner_reach + slop, shape.box.center + inner_reach - slop);
  return shape;
}

// Separating axis test of two oriented boxes (Gottschalk, Lin and Manocha 1996). Touching counts. Inside: no
// corner of b lies beyond a face of a.
bool box_holds(OrientedBox a, bool inside, OrientedBox b) {
  const vec4 to_a = conjugate(a.q);
  const vec3 t = rotate(to_a, b.center - a.center);
  const mat3 r = axes_of(quat_product(to_a, b.q));
  const mat3 s = mat3(abs(r[0]), abs(r[1]), abs(r[2]));
  const vec3 b_reach = s * b.half_extent;
  const bool is_inside = all(lessThanEqual(abs(t) + b_reach, a.half_extent));
  bool apart = any(greaterThan(abs(t), a.half_extent + b_reach));
  [[unroll]] for (int j = 0; j < 3; ++j) {
    apart = apart || abs(dot(t, r[j])) > dot(a.half_extent, s[j]) + b.half_extent[j];
  }
  // Parallel edges give null axes, which separate nothing; the slack covers their rounding.
  const float slack = 1e-6 * (length(t) + 1e-3);
  [[unroll]] for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    [[unroll]] for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;
      const float reach_a = a.half_extent[i1] * s[j][i2] + a.half_extent[i2] * s[j][i1];
      const float reach_b = b.half_extent[j1] * s[j2][i] + b.half_extent[j2] * s[j1][i];
      apart = apart || abs(t[i2] * r[j][i1] - t[i1] * r[j][i2]) > reach_a + reach_b + slack;
    }
  }
  return inside ? is_inside : !apart;
}

// Inside: the corner that is farthest from the centre lies in the sphere.
bool sphere_holds(vec3 center, float radius, bool inside, OrientedBox b) {
  const vec3 p = abs(rotate(conjugate(b.q), center - b.center));
  const vec3 reach = inside ? p + b.half_extent : max(p - b.half_extent, vec3(0.0));
  return dot(reach, reach) <= radius * radius;
}

bool holds(Shape shape, OrientedBox b) {
  const bool in_sphere = sphere_holds(shape.box.center, shape.box.half_extent.x, shape.wants_inside, b);
  const bool in_box = box_holds(shape.box, shape.wants_inside, b);
  return shape.is_sphere ? in_sphere : in_box;
}

ChildMasks children_of(PackedNode node, Shape shape) {
  return ChildMasks(children_meeting(node, shape.outer.lo, shape.outer.hi),
                    children_inside(node, shape.inner.lo, shape.inner.hi));
}

#endif
