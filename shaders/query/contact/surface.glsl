// A side of a pair of surfaces (shared/surface.h) and its triangles.
//
// Included after the bindings `nodes`, `triangles` and `geometries`.
#ifndef RTSTDB_QUERY_CONTACT_SURFACE_GLSL
#define RTSTDB_QUERY_CONTACT_SURFACE_GLSL
#include "common/motion.glsl"
#include "shared/entity.h"
#include "shared/surface.h"

uint depth = 0u;
uint rounds = 0u;
bool cut_short = false;
float box_limit;
#include "query/nearest_first.glsl"
#include "query/nearest/geometry.glsl"

const float nowhere = 3.4e38;  // farther than anything

uint root_of(uint geometry) { return texelFetch(geometries, int(geometry * geometry_texels)).w; }

bool is_closed(uint geometry) { return texelFetch(geometries, int(geometry * geometry_texels) + 1).w != 0u; }

uint field_of(uint geometry) { return texelFetch(geometries, int(geometry * geometry_texels) + 7).x; }

uint first_slot_of(uint geometry) { return texelFetch(geometries, int(geometry * geometry_texels) + 7).y; }

struct Triangle {
  vec3 a;
  vec3 b;
  vec3 c;
  uint index;
};

vec3 center_of(Triangle t) { return (t.a + t.b + t.c) / 3.0; }

// The greatest distance of a point of the triangle from `point`.
float farthest_from(Triangle t, vec3 point) {
  return max(distance(t.a, point), max(distance(t.b, point), distance(t.c, point)));
}

Triangle fetch_triangle(uint slot) {
  const int base = int(slot * triangle_texels);
  const vec4 t0 = texelFetch(triangles, base);
  return Triangle(t0.xyz, texelFetch(triangles, base + 1).xyz, texelFetch(triangles, base + 2).xyz,
                  floatBitsToUint(t0.w));
}

// A position of the surface's geometry, in the frame of the side.
vec3 placed(SurfaceSide side, vec3 position) {
  return rotate(side.q, position * side.surface_scale) + side.origin_m;
}

Triangle surface_triangle(SurfaceSide side, uint slot) {
  const Triangle t = fetch_triangle(slot);
  return Triangle(placed(side, t.a), placed(side, t.b), placed(side, t.c), t.index);
}

Triangle body_triangle(SurfaceSide side, uint slot) {
  const Triangle t = fetch_triangle(slot);
  return Triangle(t.a * side.body_scale, t.b * side.body_scale, t.c * side.body_scale, t.index);
}

// The normal on the front of a triangle: unit. Of a triangle without area +z.
vec3 front_of(Triangle t) {
  const vec3 n = cross(t.b - t.a, t.c - t.a);
  const float size = max(max(abs(n.x), abs(n.y)), abs(n.z));
  return size > 0.0 ? normalize(n / size) : vec3(0.0, 0.0, 1.0);
}

#endif
