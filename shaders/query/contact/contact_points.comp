#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The points at which two convex bodies touch: a face of each, at the point where they are deepest in one
// another, is clipped against the other (van den Bergen, "Collision Detection in Interactive 3D
// Environments", 2003).
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer hulls;
layout(set = 0, binding = 1, scalar) readonly buffer PairsBuffer { PairRecord pairs[]; };
layout(set = 0, binding = 2, scalar) buffer ResultsBuffer { PairResult results[]; };
layout(set = 0, binding = 3, scalar) readonly buffer TouchingBuffer { uint touching[]; };  // pairs by place
layout(set = 0, binding = 4, scalar) buffer PointsBuffer { PairPoints points[]; };

uint rounds = 0u;
#include "query/contact/hull.glsl"

const uint max_clipped = 2u * hull_max_polygon_corners;

real3 side[hull_max_polygon_corners];  // the polygon whose sides clip
uint sides = 0u;
real3 clipped[max_clipped];  // the other polygon, and what is left of it
uint clipped_count = 0u;
real3 copied[max_clipped];

// A flat face of a body. On a solid's curved surface it is a line parallel to the axis, or a single point;
// its `index` is the number of flat faces then.
struct Face {
  uint index;
  real3 normal;  // unit, frame of the pair
  uint polygon_texel;
  uint corner_count;  // 2: a line; 0: a single point
  real3 from;         // of a line
  real3 to;
};

// The line of a capsule or a cylinder, whose core has two corners, that faces the direction; of a sphere, or
// where the direction is along the axis, a single point.
Face curved_face(Hull hull, real3 direction) {
  Face face = Face(hull.faces, direction, 0u, 0u, real3(0.0LF), real3(0.0LF));
  const real3 from = corner_at(hull, hull.texel + hull_header_texels);
  const real3 to = corner_at(hull, hull.texel + hull_header_texels + 1u);
  const real3 axis = to - from;
  const real square = dot(axis, axis);
  const real3 d = hull.scale * (direction * hull.axes);
  const real3 across = d - axis * (dot(axis, d) / max(square, 1e-37));
  const real length_across = length(across);
  if (square > 0.0 && length_across > 1e-6 * length(d)) {
    const real3 outwards = across / length_across;
    face.normal = normalize(hull.axes * (outwards / hull.scale));
    face.corner_count = 2u;
    face.from = placed(hull, from + hull.round_radius * outwards);
    face.to = placed(hull, to + hull.round_radius * outwards);
  }
  return face;
}

// The sine of the angle between two lines.
real crossing_of(Face first, Face second) {
  return length(cross(normalize(first.to - first.from), normalize(second.to - second.from)));
}

// The score of a face: the cosine between its normal and `direction`, less the distance of the point from the
// face beyond slack_m, in units of slack_m.
real score_of(real3 normal, real off_m, real3 direction, real slack_m) {
  return dot(normal, direction) - max(off_m - slack_m, 0.0LF) / slack_m;
}

// A face under test. The sides of its polygon are tested one by one where its plane is near the point.
struct FaceTest {
  Face face;
  real height;        // of the point above its plane, absolute
  real side_square;   // the least squared distance of the point from the sides tested so far
  bool is_beside;     // the point is outside one of them
  uint tested_sides;  // of the polygon
};

FaceTest test_of(Hull hull, uint f, real3 point) {
  const vec4 texel = texelFetch(hulls, int(hull.face_texel + f));
  const uint polygon = floatBitsToUint(texel.w);
  const uint first = hull.polygon_texel + (polygon & 0xFFFFFFu);
  const real3 normal = normalize(hull.axes * (real3(texel.xyz) / hull.scale));
  const real height = abs(dot(normal, point - placed(hull, corner_at(hull, first))));
  return FaceTest(Face(f, normal, first, polygon >> 24, real3(0.0LF), real3(0.0LF)), height, real_max, false,
                  0u);
}

// The corners of a polygon are counter-clockwise from its front.
void test_side(Hull hull, real3 point, inout FaceTest test) {
  const uint next = test.tested_sides + 1u < test.face.corner_count ? test.tested_sides + 1u : 0u;
  const real3 from = placed(hull, corner_at(hull, test.face.polygon_texel + test.tested_sides));
  const real3 side_m = placed(hull, corner_at(hull, test.face.polygon_texel + next)) - from;
  const real3 off = point - from;
  const real along = clamp(dot(off, side_m) / max(dot(side_m, side_m), real_tiny), 0.0LF, 1.0LF);
  const real3 to_side = off - along * side_m;
  test.side_square = min(test.side_square, dot(to_side, to_side));
  test.is_beside = test.is_beside || dot(cross(side_m, off), test.face.normal) < 0.0LF;
  ++test.tested_sides;
}

// The normal of a polygon in double precision: that of three of its corners, where it differs from the stored
// normal by rounding.
real3 normal_of_polygon(Hull hull, Face face) {
  const real3 a = placed(hull, corner_at(hull, face.polygon_texel));
  const real3 b = placed(hull, corner_at(hull, face.polygon_texel + face.corner_count / 3u));
  const real3 c = placed(hull, corner_at(hull, face.polygon_texel + 2u * face.corner_count / 3u));
  const real3 n = cross(b - a, c - a);
  const real3 unit = n / max(length(n), real_tiny);
  return length(cross(unit, face.normal)) < 1e-6LF && dot(unit, face.normal) > 0.0LF ? unit : face.normal;
}

// The face of a hull that is most perpendicular to `direction`, of those that the point is on.
Face face_at(Hull hull, real3 point, real3 direction, real slack_m) {
  Face best = Face(0u, direction, hull.polygon_texel, 0u, real3(0.0LF), real3(0.0LF));
  real best_score = -3.4e38;
  if (hull.round_radius > 0.0) {
    const Face curved = curved_face(hull, direction);
    const real off_m = abs(dot(curved.normal, point - curved.from));
    best_score = curved.corner_count == 2u ? score_of(curved.normal, off_m, direction, slack_m) : 0.0;
    // Beside the line: on the end of a capsule.
    if (best_score >= 0.0) best = curved;
    best.index = hull.faces;
    best_score = max(best_score, 0.0);
  }
  // One loop for faces and sides: lavapipe would count a round of an inner loop for each face.
  uint f = 0u;
  FaceTest test;
  test.tested_sides = 0u;
  do {
    ++rounds;
    if (f < hull.faces) {
      if (test.tested_sides == 0u) test = test_of(hull, f, point);
      const real height_score = score_of(test.face.normal, test.height, direction, slack_m);
      // The plane is as near as the polygon, or nearer, so height_score bounds the score. A face whose plane
      // is not near can not win against one that the point is on.
      if (test.height < 4.0LF * slack_m && height_score > best_score) test_side(hull, point, test);
      if (test.tested_sides == 0u || test.tested_sides == test.face.corner_count) {
        const real off_m = test.is_beside ? sqrt(test.side_square) : test.height;
        const real score = score_of(test.face.normal, off_m, direction, slack_m);
        best = score > best_score ? test.face : best;
        best_score = max(best_score, score);
        test.tested_sides = 0u;
        ++f;
      }
    }
  } while (f < hull.faces);
  if (best.corner_count > 2u) best.normal = normal_of_polygon(hull, best);
  return best;
}

real3 corner_of(Hull hull, Face face, uint i) {
  if (face.corner_count == 2u) return i == 0u ? face.from : face.to;
  return placed(hull, corner_at(hull, face.polygon_texel + i));
}

void load_sides(Hull hull, Face face) {
  sides = face.corner_count;
  uint i = 0u;
  do {
    ++rounds;
    if (i < sides) {
      side[i] = corner_of(hull, face, i);
      ++i;
    }
  } while (i < sides);
}

void load_clipped(Hull hull, Face face) {
  clipped_count = face.corner_count;
  uint i = 0u;
  do {
    ++rounds;
    if (i < clipped_count) {
      clipped[i] = corner_of(hull, face, i);
      ++i;
    }
  } while (i < clipped_count);
}

// Keeps the part of the polygon that is not in front of the plane (Sutherland and Hodgman 1974).
void clip(real3 on_plane, real3 normal) {
  uint i = 0u;
  do {
    ++rounds;
    if (i < clipped_count) {
      copied[i] = clipped[i];
      ++i;
    }
  } while (i < clipped_count);
  const uint count = clipped_count;
  uint kept = 0u;
  i = 0u;
  do {
    ++rounds;
    if (i < count) {
      const real3 from = copied[i];
      const real3 to = copied[i + 1u < count ? i + 1u : 0u];
      const real from_height = dot(normal, from - on_plane);
      const real to_height = dot(normal, to - on_plane);
      if (from_height <= 0.0 && kept < max_clipped) clipped[kept++] = from;
      const bool crosses = (from_height < 0.0 && to_height > 0.0) || (from_height > 0.0 && to_height < 0.0);
      if (crosses && kept < max_clipped)
        clipped[kept++] = from + from_height / (from_height - to_height) * (to - from);
      ++i;
    }
  } while (i < count);
  clipped_count = kept;
}

// Clips against the prism over the polygon of `side` along `direction`, which is on the front of the polygon.
// A line clips at its ends.
void clip_against_sides(real3 direction) {
  uint i = 0u;
  do {
    ++rounds;
    if (i < sides) {
      const real3 from = side[i];
      const real3 to = side[i + 1u < sides ? i + 1u : 0u];
      clip(from, sides == 2u ? from - to : cross(to - from, direction));
      ++i;
    }
  } while (i < sides);
}

// Contact points of the clipped polygon: midway between the surfaces, with the depth. Those beyond the limit
// are removed.
real4 candidate[max_clipped];
uint candidates = 0u;

void measure(real3 on_plane, real3 plane_normal, real3 toward, real min_depth, real max_depth) {
  const real slope = dot(toward, plane_normal);
  candidates = 0u;
  uint i = 0u;
  do {
    ++rounds;
    if (i < clipped_count) {
      const real3 p = clipped[i];
      const real depth = min(-dot(p - on_plane, plane_normal) / slope, max_depth);
      if (depth >= min_depth) candidate[candidates++] = real4(p + 0.5 * depth * toward, depth);
      ++i;
    }
  } while (i < clipped_count);
}

// The first of the candidates whose depth differs from the largest by less than `tie`.
uint deepest(real tie) {
  uint best = 0u;
  uint i = 0u;
  do {
    ++rounds;
    if (i < candidates) {
      best = candidate[i].w > candidate[best].w + tie ? i : best;
      ++i;
    }
  } while (i < candidates);
  return best;
}

uint farthest_from(real3 p, out real square) {
  uint best = 0u;
  square = 0.0;
  uint i = 0u;
  do {
    ++rounds;
    if (i < candidates) {
      const real3 off = candidate[i].xyz - p;
      const bool is_farther = dot(off, off) > square;
      square = is_farther ? dot(off, off) : square;
      best = is_farther ? i : best;
      ++i;
    }
  } while (i < candidates);
  return best;
}

// The candidate that spans the largest triangle with a and b on the side that `n` says.
uint widest_on_side(real3 a, real3 b, real3 n, out real area) {
  uint best = 0u;
  area = 0.0;
  uint i = 0u;
  do {
    ++rounds;
    if (i < candidates) {
      const real spanned = dot(cross(b - a, candidate[i].xyz - a), n);
      const bool is_wider = spanned > area;
      area = is_wider ? spanned : area;
      best = is_wider ? i : best;
      ++i;
    }
  } while (i < candidates);
  return best;
}

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
  const uint index = touching[place];
  const PairRecord record = pairs[index];
  const PairResult result = results[index];
  const Hull first = first_hull_of(record);
  const Hull second = second_hull_of(record);
  const real depth = -result.distance_m;
  const real slack = 2.0 * record.precision_m;
  const real3 n = real3(result.n);
  const real3 on_second = result.point_m + depth * n;
  const Face first_face = face_at(first, result.point_m, -n, slack);
  const Face second_face = face_at(second, on_second, n, slack);
  const real first_slope = -dot(first_face.normal, n);
  const real second_slope = dot(second_face.normal, n);
  // A line is clipped by a face.
  const bool second_is_line = second_face.corner_count == 2u && first_face.corner_count > 2u;
  const bool first_is_line = first_face.corner_count == 2u && second_face.corner_count > 2u;
  const bool first_is_plane = second_is_line || (!first_is_line && first_slope > second_slope);
  const bool are_lines = first_face.corner_count == 2u && second_face.corner_count == 2u;
  const bool are_crossed = are_lines && crossing_of(first_face, second_face) > 0.01;
  const bool is_single_point = first_face.corner_count == 0u || second_face.corner_count == 0u || are_crossed;
  candidates = 0u;
  if (!is_single_point && (first_is_plane ? first_slope > 0.1 : second_slope > 0.1)) {
    if (first_is_plane) {
      load_sides(first, first_face);
      load_clipped(second, second_face);
    } else {
      load_sides(second, second_face);
      load_clipped(first, first_face);
    }
    const real3 plane_normal = first_is_plane ? first_face.normal : second_face.normal;
    // From the polygon that is clipped to the plane.
    const real3 toward = first_is_plane ? -n : n;
    clip_against_sides(toward);
    measure(side[0], plane_normal, toward, -record.margin_m - 0.5LF * record.precision_m, depth);
  }

  PairPoints found;
  found.first_face = first_face.index;
  found.second_face = second_face.index;
  found.point_0 = vec4(vec3(result.point_m + 0.5LF * depth * n), float(depth));
  found.point_1 = vec4(0.0);
  found.point_2 = vec4(0.0);
  found.point_3 = vec4(0.0);
  found.count = 1u;
  const real tie = 0.1LF * record.precision_m;
  const uint deep = deepest(tie);
  if (candidates > 0u && candidate[deep].w >= depth - 2.0LF * tie) found.point_0 = vec4(candidate[deep]);
  const real least = slack * slack;
  real square, left_area, right_area;
  const uint far = farthest_from(found.point_0.xyz, square);
  if (candidates > 0u && square > least) {
    const real3 a = found.point_0.xyz;
    const real3 b = candidate[far].xyz;
    found.point_1 = vec4(candidate[far]);
    found.count = 2u;
    const uint on_left = widest_on_side(a, b, n, left_area);
    const uint on_right = widest_on_side(a, b, -n, right_area);
    const real min_area = slack * sqrt(square);
    if (left_area > min_area) {
      found.point_2 = vec4(candidate[on_left]);
      ++found.count;
    }
    if (right_area > min_area) {
      if (found.count == 3u)
        found.point_3 = vec4(candidate[on_right]);
      else
        found.point_2 = vec4(candidate[on_right]);
      ++found.count;
    }
  }
  if (!loops_still_turn(args.loop_probe)) found.count = 0u;
  points[place] = found;
}
