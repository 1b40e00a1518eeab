// A pair of hulls and their support points (shared/contact.h). Included after the declarations of `hulls`
// and `rounds`.
#ifndef RTSTDB_QUERY_CONTACT_HULL_GLSL
#define RTSTDB_QUERY_CONTACT_HULL_GLSL
#include "common/motion.glsl"
#include "shared/contact.h"

// A hull in the frame of the pair.
struct Hull {
  uint texel;
  uint corners;
  uint faces;
  uint nodes;
  uint face_texel;
  uint polygon_texel;
  vec3 round_axis;     // of a disc, unit; zero: of a ball
  float round_radius;  // 0: the hull of its corners alone
  vec3 scale;
  mat3 axes;    // of the entity
  vec3 center;  // of the hull
};

Hull fetch_hull(uint texel, vec3 scale, mat3 axes, vec3 center) {
  const uint corners = floatBitsToUint(texelFetch(hulls, int(texel)).w);
  const uvec4 sizes = floatBitsToUint(texelFetch(hulls, int(texel) + 1));
  const vec4 round = texelFetch(hulls, int(texel) + 2);
  return Hull(texel, corners, sizes.x, sizes.y, texel + sizes.z, texel + sizes.w, round.xyz, round.w, scale,
              axes, center);
}

Hull first_hull_of(PairRecord record) {
  return fetch_hull(record.first_hull, record.first_scale, axes_of(record.q), record.center_m);
}

Hull second_hull_of(PairRecord record) {
  return fetch_hull(record.second_hull, record.second_scale, mat3(1.0), vec3(0.0));
}

vec3 placed(Hull hull, vec3 corner) { return hull.axes * (hull.scale * corner) + hull.center; }

// The corner with the largest coordinate along d among `count` corners from `texel` on; the first of several.
// Four corners are compared in a round, and a hull's corners are a multiple of four.
void scan_corners(uint texel, uint count, vec3 d, inout float best, inout vec3 corner) {
  uint i = 0u;
  do {
    ++rounds;
    if (i < count) {
      [[unroll]] for (uint k = 0u; k < hull_corners_per_step; ++k) {
        const vec3 candidate = texelFetch(hulls, int(texel + i + k)).xyz;
        const float along = dot(candidate, d);
        const bool farther = along > best;
        best = farther ? along : best;
        corner = farther ? candidate : corner;
      }
      i += hull_corners_per_step;
    }
  } while (i < count);
}

// Visits the nodes of the tree in order and passes over those whose sphere does not reach beyond the best
// corner so far.
void search_corners(Hull hull, vec3 d, inout float best, inout vec3 corner) {
  const uint node_texel = hull.face_texel - hull_node_texels * hull.nodes;
  const float length_d = length(d);
  uint node = 0u;
  do {
    ++rounds;
    uint first = 0u;
    uint count = 0u;
    if (node < hull.nodes) {
      const int texel = int(node_texel + hull_node_texels * node);
      const vec4 sphere = texelFetch(hulls, texel);
      const uvec4 links = floatBitsToUint(texelFetch(hulls, texel + 1));
      const bool reaches = dot(sphere.xyz, d) + sphere.w * length_d > best;
      first = links.y;
      count = reaches ? links.z : 0u;
      node = reaches ? node + 1u : links.x;
    }
    scan_corners(hull.texel + hull_header_texels + first, count, d, best, corner);
  } while (node < hull.nodes);
}

// The farthest point of the ball or the disc of a solid along d.
vec3 round_support(Hull hull, vec3 d) {
  const vec3 across = d - hull.round_axis * dot(hull.round_axis, d);
  const float length_across = length(across);
  return length_across > 1e-20 ? across * (hull.round_radius / length_across) : vec3(0.0);
}

// The hull's farthest point along a direction of the pair's frame.
vec3 support(Hull hull, vec3 direction) {
  const vec3 d = hull.scale * (direction * hull.axes);
  float best = -3.4e38;
  vec3 corner = vec3(0.0);
  if (hull.nodes == 0u)
    scan_corners(hull.texel + hull_header_texels, hull.corners, d, best, corner);
  else
    search_corners(hull, d, best, corner);
  return placed(hull, corner + round_support(hull, d));
}

// A point of the Minkowski difference (first minus second) and the point of the first hull in it.
struct Difference {
  vec3 w;
  vec3 a;
};

Difference support_of_difference(Hull first, Hull second, vec3 direction) {
  const vec3 a = support(first, direction);
  return Difference(a - support(second, -direction), a);
}

#endif
