// A pair of hulls and their support points (shared/contact.h). Included after the declarations of `hulls`
// and `rounds`.
//
// The hull of a sphere or a capsule of uniform scale is its core, a point or a segment. The body is all
// points within the distance `skin` of the core. So the distance of two bodies is that of their cores less
// both skins, whether they are apart or penetrate, and their normal is that of their cores. Other curved
// bodies are the sums of a core and a disc or an ellipsoid (round_support).
#ifndef RTSTDB_QUERY_CONTACT_HULL_GLSL
#define RTSTDB_QUERY_CONTACT_HULL_GLSL
#include "query/contact/real.glsl"
#include "shared/contact.h"

// A hull in the frame of the pair.
struct Hull {
  uint texel;
  uint corners;
  uint faces;
  uint nodes;
  uint face_texel;
  uint polygon_texel;
  real3 reference;    // the centre in the entity's frame, not scaled
  real3 round_axis;   // of a disc, unit; zero: of a ball
  real round_radius;  // 0: the hull of its corners alone
  real skin;          // distance of the surface from the core; 0: the disc or ball is part of the hull
  real3 scale;
  real3x3 axes;  // of the entity
  real3 center;  // of the hull
};

Hull fetch_hull(uint texel, real3 scale, real3x3 axes, real3 center) {
  const vec4 head = texelFetch(hulls, int(texel));
  const uvec4 sizes = floatBitsToUint(texelFetch(hulls, int(texel) + 1));
  const vec4 round = texelFetch(hulls, int(texel) + 2);
  const bool has_uniform_scale = scale.x == scale.y && scale.y == scale.z;
  const real skin = round.xyz == vec3(0.0) && has_uniform_scale ? real(round.w) * scale.x : real(0.0);
  return Hull(texel, floatBitsToUint(head.w), sizes.x, sizes.y, texel + sizes.z, texel + sizes.w,
              real3(head.xyz), real3(round.xyz), real(round.w), skin, scale, axes, center);
}

// The columns of a rotation.
real3x3 axes_of_pose(real4 q) {
  const real3 twice_q = real(2.0) * q.xyz;
  const real xx = q.x * twice_q.x, yy = q.y * twice_q.y, zz = q.z * twice_q.z;
  const real xy = q.x * twice_q.y, xz = q.x * twice_q.z, yz = q.y * twice_q.z;
  const real wx = q.w * twice_q.x, wy = q.w * twice_q.y, wz = q.w * twice_q.z;
  return real3x3(real3(real(1.0) - yy - zz, xy + wz, xz - wy), real3(xy - wz, real(1.0) - xx - zz, yz + wx),
                 real3(xz + wy, yz - wx, real(1.0) - xx - yy));
}

#ifdef CONTACT_DOUBLE
Hull first_hull_of(PairRecord record) {
  return fetch_hull(record.first_hull, dvec3(record.first_scale) + dvec3(record.first_scale_low),
                    axes_of_pose(dvec4(record.q) + dvec4(record.q_low)),
                    dvec3(record.center_m) + dvec3(record.center_low_m));
}

Hull second_hull_of(PairRecord record) {
  return fetch_hull(record.second_hull, dvec3(record.second_scale) + dvec3(record.second_scale_low),
                    dmat3(1.0LF), dvec3(0.0LF));
}
#else
Hull first_hull_of(PairRecord record) {
  return fetch_hull(record.first_hull, record.first_scale, axes_of_pose(record.q), record.center_m);
}

Hull second_hull_of(PairRecord record) {
  return fetch_hull(record.second_hull, record.second_scale, mat3(1.0), vec3(0.0));
}
#endif

// A position in the entity's frame, relative to the hull's centre.
real3 corner_at(Hull hull, uint texel) { return real3(texelFetch(hulls, int(texel)).xyz) - hull.reference; }

real3 placed(Hull hull, real3 corner) { return hull.axes * (hull.scale * corner) + hull.center; }

// The corner with the largest coordinate along d among `count` corners from `texel` on; the first of several.
// Four corners are compared in a round, and a hull's corners are a multiple of four.
void scan_corners(Hull hull, uint texel, uint count, real3 d, inout real best, inout real3 corner) {
  uint i = 0u;
  do {
    ++rounds;
    if (i < count) {
      [[unroll]] for (uint k = 0u; k < hull_corners_per_step; ++k) {
        const real3 candidate = corner_at(hull, texel + i + k);
        const real along = dot(candidate, d);
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
void search_corners(Hull hull, real3 d, inout real best, inout real3 corner) {
  const uint node_texel = hull.face_texel - hull_node_texels * hull.nodes;
  const real length_d = length(d);
  uint node = 0u;
  do {
    ++rounds;
    uint first = 0u;
    uint count = 0u;
    if (node < hull.nodes) {
      const uint texel = node_texel + hull_node_texels * node;
      const real radius = real(texelFetch(hulls, int(texel)).w);
      const uvec4 links = floatBitsToUint(texelFetch(hulls, int(texel) + 1));
      const bool reaches = dot(corner_at(hull, texel), d) + radius * length_d > best;
      first = links.y;
      count = reaches ? links.z : 0u;
      node = reaches ? node + 1u : links.x;
    }
    scan_corners(hull, hull.texel + hull_header_texels + first, count, d, best, corner);
  } while (node < hull.nodes);
}

// The farthest point of the ball or the disc of a solid along d.
real3 round_support(Hull hull, real3 d) {
  const real3 across = d - hull.round_axis * dot(hull.round_axis, d);
  const real length_across = length(across);
  return length_across > real_tiny ? across * (hull.round_radius / length_across) : real3(0.0);
}

// The hull's farthest point along a direction of the pair's frame.
real3 support(Hull hull, real3 direction) {
  const real3 d = hull.scale * (direction * hull.axes);
  real best = -real_max;
  real3 corner = real3(0.0);
  if (hull.nodes == 0u)
    scan_corners(hull, hull.texel + hull_header_texels, hull.corners, d, best, corner);
  else
    search_corners(hull, d, best, corner);
  const bool is_round = hull.round_radius > real(0.0) && hull.skin == real(0.0);
  return placed(hull, is_round ? corner + round_support(hull, d) : corner);
}

// A point of the Minkowski difference (first minus second) and the point of the first hull in it.
struct Difference {
  real3 w;
  real3 a;
};

Difference support_of_difference(Hull first, Hull second, real3 direction) {
  const real3 a = support(first, direction);
  return Difference(a - support(second, -direction), a);
}

#ifdef CONTACT_DOUBLE
// The least coordinate of the first hull along the unit direction n, minus the largest of the second: a lower
// bound of their distance.
double gap_along(Hull first, Hull second, dvec3 n) {
  return dot(support_of_difference(first, second, -n).w, n);
}

// Searches know the direction in which a corner touches the side of a cylinder only to the root of their
// precision. It is that from the cylinder's axis to the corner. `n`: unit, from the second hull to the first.
dvec3 refined_by_axis(Hull first, Hull second, dvec3 n) {
  dvec3 best = n;
  [[unroll]] for (uint side = 0u; side < 2u; ++side) {
    const Hull cylinder = side == 0u ? first : second;
    const dvec3 outwards = side == 0u ? -n : n;  // of the cylinder
    const dvec3 axis = cylinder.axes * cylinder.round_axis;
    const bool is_cylinder = cylinder.round_radius > 0.0LF && cylinder.skin == 0.0LF &&
                             cylinder.scale.x == cylinder.scale.y && cylinder.scale.y == cylinder.scale.z &&
                             cylinder.round_axis != dvec3(0.0LF) && abs(dot(axis, n)) < 0.01LF;
    const dvec3 corner = side == 0u ? support(second, -outwards) : support(first, -outwards);
    const dvec3 core = placed(cylinder, corner_at(cylinder, cylinder.texel + hull_header_texels));
    const dvec3 from_core = corner - core;
    const dvec3 across = from_core - axis * dot(axis, from_core);
    const dvec3 direction = across / max(length(across), real_tiny);
    const dvec3 candidate = side == 0u ? -direction : direction;
    const bool is_near = is_cylinder && dot(candidate, best) > 0.999LF;
    const bool is_better = is_near && gap_along(first, second, candidate) > gap_along(first, second, best);
    best = is_better ? candidate : best;
  }
  return best;
}
#endif

#endif
