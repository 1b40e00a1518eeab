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

vec3 side[hull_max_polygon_corners];  // the polygon whose sides clip
uint sides = 0u;
vec3 clipped[max_clipped];  // the other polygon, and what is left of it
uint clipped_count = 0u;
vec3 copied[max_clipped];

// Of a solid's curved surface: the line on it that is parallel to the axis, or a single point. Then `index`
// is the number of flat faces.
struct Face {
  uint index;
  vec3 normal;  // unit, frame of the pair
  uint polygon_texel;
  uint corner_count;  // 2: a line; 0: a single point
  vec3 from;          // of a line
  vec3 to;
};

// The line of a capsule or a cylinder, whose core has two corners, that faces the direction; of a sphere, or
// where the direction is along the axis, a single point.
Face curved_face(Hull hull, vec3 direction) {
  Face face = Face(hull.faces, direction, 0u, 0u, vec3(0.0), vec3(0.0));
  const vec3 from = texelFetch(hulls, int(hull.texel + hull_header_texels)).xyz;
  const vec3 to = texelFetch(hulls, int(hull.texel + hull_header_texels) + 1).xyz;
  const vec3 axis = to - from;
  const float square = dot(axis, axis);
  const vec3 d = hull.scale * (direction * hull.axes);
  const vec3 across = d - axis * (dot(axis, d) / max(square, 1e-37));
  const float length_across = length(across);
  if (square > 0.0 && length_across > 1e-6 * length(d)) {
    const vec3 outwards = across / length_across;
    face.normal = normalize(hull.axes * (outwards / hull.scale));
    face.corner_count = 2u;
    face.from = placed(hull, from + hull.round_radius * outwards);
    face.to = placed(hull, to + hull.round_radius * outwards);
  }
  return face;
}

// The sine of the angle between two lines.
float crossing_of(Face first, Face second) {
  return length(cross(normalize(first.to - first.from), normalize(second.to - second.from)));
}

// The score of a face: the cosine between its normal and `direction`, less the distance of `point` from its
// plane beyond slack_m, in units of slack_m.
float score_of(vec3 normal, vec3 on_plane, vec3 point, vec3 direction, float slack_m) {
  const float off = max(abs(dot(normal, point - on_plane)) - slack_m, 0.0);
  return dot(normal, direction) - off / slack_m;
}

// The face of a hull that is most perpendicular to `direction`, of those whose plane contains the point.
Face face_at(Hull hull, vec3 point, vec3 direction, float slack_m) {
  Face best = Face(0u, direction, hull.polygon_texel, 0u, vec3(0.0), vec3(0.0));
  float best_score = -3.4e38;
  if (hull.round_radius > 0.0) {
    const Face curved = curved_face(hull, direction);
    best_score =
        curved.corner_count == 2u ? score_of(curved.normal, curved.from, point, direction, slack_m) : 0.0;
    // Beside the line: on the end of a capsule.
    if (best_score >= 0.0) best = curved;
    best.index = hull.faces;
    best_score = max(best_score, 0.0);
  }
  uint f = 0u;
  do {
    ++rounds;
    if (f < hull.faces) {
      const vec4 texel = texelFetch(hulls, int(hull.face_texel + f));
      const uint polygon = floatBitsToUint(texel.w);
      const uint first = hull.polygon_texel + (polygon & 0xFFFFFFu);
      const vec3 normal = normalize(hull.axes * (texel.xyz / hull.scale));
      const vec3 corner = placed(hull, texelFetch(hulls, int(first)).xyz);
      const float score = score_of(normal, corner, point, direction, slack_m);
      if (score > best_score) {
        best_score = score;
        best = Face(f, normal, first, polygon >> 24, vec3(0.0), vec3(0.0));
      }
      ++f;
    }
  } while (f < hull.faces);
  return best;
}

vec3 corner_of(Hull hull, Face face, uint i) {
  if (face.corner_count == 2u) return i == 0u ? face.from : face.to;
  return placed(hull, texelFetch(hulls, int(face.polygon_texel + i)).xyz);
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
void clip(vec3 on_plane, vec3 normal) {
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
      const vec3 from = copied[i];
      const vec3 to = copied[i + 1u < count ? i + 1u : 0u];
      const float from_height = dot(normal, from - on_plane);
      const float to_height = dot(normal, to - on_plane);
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
void clip_against_sides(vec3 direction) {
  uint i = 0u;
  do {
    ++rounds;
    if (i < sides) {
      const vec3 from = side[i];
      const vec3 to = side[i + 1u < sides ? i + 1u : 0u];
      clip(from, sides == 2u ? from - to : cross(to - from, direction));
      ++i;
    }
  } while (i < sides);
}

// What was clipped, as contact points: midway between the surfaces, with the depth. Those beyond the limit
// are removed.
vec4 candidate[max_clipped];
uint candidates = 0u;

void measure(vec3 on_plane, vec3 plane_normal, vec3 toward, float min_depth, float max_depth) {
  const float slope = dot(toward, plane_normal);
  candidates = 0u;
  uint i = 0u;
  do {
    ++rounds;
    if (i < clipped_count) {
      const vec3 p = clipped[i];
      const float depth = min(-dot(p - on_plane, plane_normal) / slope, max_depth);
      if (depth >= min_depth) candidate[candidates++] = vec4(p + 0.5 * depth * toward, depth);
      ++i;
    }
  } while (i < clipped_count);
}

uint deepest() {
  uint best = 0u;
  uint i = 0u;
  do {
    ++rounds;
    if (i < candidates) {
      best = candidate[i].w > candidate[best].w ? i : best;
      ++i;
    }
  } while (i < candidates);
  return best;
}

uint farthest_from(vec3 p, out float square) {
  uint best = 0u;
  square = 0.0;
  uint i = 0u;
  do {
    ++rounds;
    if (i < candidates) {
      const vec3 off = candidate[i].xyz - p;
      const bool is_farther = dot(off, off) > square;
      square = is_farther ? dot(off, off) : square;
      best = is_farther ? i : best;
      ++i;
    }
  } while (i < candidates);
  return best;
}

// The candidate that spans the largest triangle with a and b on the side that `n` says.
uint widest_on_side(vec3 a, vec3 b, vec3 n, out float area) {
  uint best = 0u;
  area = 0.0;
  uint i = 0u;
  do {
    ++rounds;
    if (i < candidates) {
      const float spanned = dot(cross(b - a, candidate[i].xyz - a), n);
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
  const float depth = -result.distance_m;
  const float slack = max(1e-4 * record.size_m, 4.0 * record.rounding_m);
  const vec3 n = result.n;
  const vec3 on_second = result.point_m + depth * n;
  const Face first_face = face_at(first, result.point_m, -n, slack);
  const Face second_face = face_at(second, on_second, n, slack);
  const float first_slope = -dot(first_face.normal, n);
  const float second_slope = dot(second_face.normal, n);
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
    const vec3 plane_normal = first_is_plane ? first_face.normal : second_face.normal;
    // From the polygon that is clipped to the plane.
    const vec3 toward = first_is_plane ? -n : n;
    clip_against_sides(toward);
    measure(side[0], plane_normal, toward, -record.margin_m - record.rounding_m, depth);
  }

  PairPoints found;
  found.first_face = first_face.index;
  found.second_face = second_face.index;
  found.point_0 = vec4(result.point_m + 0.5 * depth * n, depth);
  found.point_1 = vec4(0.0);
  found.point_2 = vec4(0.0);
  found.point_3 = vec4(0.0);
  found.count = 1u;
  const uint deep = deepest();
  if (candidates > 0u && candidate[deep].w >= depth - slack) found.point_0 = candidate[deep];
  const float least = slack * slack;
  float square, left, right;
  const uint far = farthest_from(found.point_0.xyz, square);
  if (candidates > 0u && square > least) {
    const vec3 a = found.point_0.xyz;
    const vec3 b = candidate[far].xyz;
    found.point_1 = candidate[far];
    found.count = 2u;
    const uint on_left = widest_on_side(a, b, n, left);
    const uint on_right = widest_on_side(a, b, -n, right);
    const float min_area = slack * sqrt(square);
    if (left > min_area) {
      found.point_2 = candidate[on_left];
      ++found.count;
    }
    if (right > min_area) {
      if (found.count == 3u)
        found.point_3 = candidate[on_right];
      else
        found.point_2 = candidate[on_right];
      ++found.count;
    }
  }
  if (!loops_still_turn(args.loop_probe)) found.count = 0u;
  points[place] = found;
}
