// An upper bound on the extent of a geometry along any direction, from its extents along 26 directions; see
// rtstdb/geometry/extents.hpp.
#ifndef RTSTDB_COMMON_EXTENTS_GLSL
#define RTSTDB_COMMON_EXTENTS_GLSL
#include "shared/entity.h"

// All measured from the centre of the geometry's box, unscaled.
struct Extents {
  vec3 faces;  // in both directions
  // Indexed by the axis without component; components: signs ++, +-, -+, -- along the other axes
  vec4 edges[3];
  vec4 corners[2];  // +x and -x; components likewise for y and z
};

Extents extents_of(GeometryRecord geometry) {
  return Extents(geometry.box_half_m, vec4[3](geometry.edges_yz_m, geometry.edges_xz_m, geometry.edges_xy_m),
                 vec4[2](geometry.corners_plus_x_m, geometry.corners_minus_x_m));
}

// Selects a component by two signs, for these signs and for the opposite ones.
vec2 by_signs(vec4 these, vec4 opposite, bool first_negative, bool second_negative) {
  const vec2 here = first_negative ? these.zw : these.xy;
  const vec2 there = first_negative ? opposite.xy : opposite.zw;
  return second_negative ? vec2(here.y, there.x) : vec2(here.x, there.y);
}

// The extents along u and along -u.
vec2 extent_along(vec3 u, Extents extents) {
  const vec3 size = abs(u);
  const float most = max(size.x, max(size.y, size.z));
  const float least = min(size.x, min(size.y, size.z));
  const float middle = max(min(size.x, size.y), min(max(size.x, size.y), size.z));
  const float face = most == size.x ? extents.faces.x : most == size.y ? extents.faces.y : extents.faces.z;
  const bool without_x = least == size.x;
  const bool without_z = !without_x && least != size.y;
  const vec4 edges = without_x ? extents.edges[0] : without_z ? extents.edges[2] : extents.edges[1];
  const vec2 edge = by_signs(edges, edges, (without_x ? u.y : u.x) < 0.0, (without_z ? u.y : u.z) < 0.0);
  const bool minus_x = u.x < 0.0;
  const vec2 corner = by_signs(minus_x ? extents.corners[1] : extents.corners[0],
                               minus_x ? extents.corners[0] : extents.corners[1], u.y < 0.0, u.z < 0.0);
  return (most - middle) * face + (middle - least) * edge + least * corner;
}

#endif
