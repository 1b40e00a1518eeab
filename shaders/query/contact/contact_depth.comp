#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The depth of two convex bodies that touch or penetrate: the expanding polytope algorithm (van den Bergen
// 2001). The polytope lies in the Minkowski difference. The least distance of its faces from the origin is a
// lower bound of the depth, and the support along the normal of such a face is an upper bound. Distances of
// faces are signed, so that bodies that touch, or that are apart by rounding alone, are no special case.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer hulls;
layout(set = 0, binding = 1, scalar) readonly buffer PairsBuffer { PairRecord pairs[]; };
layout(set = 0, binding = 2, scalar) buffer ResultsBuffer { PairResult results[]; };
layout(set = 0, binding = 3, scalar) readonly buffer DeepBuffer { uint deep[]; };  // pairs by place

uint rounds = 0u;
#include "query/contact/hull.glsl"
#include "query/nearest_on_triangle.glsl"

const uint max_vertices = 64u;
const uint max_faces = 2u * max_vertices;
const uint local_vertices = 16u;  // of them, for the search in the best direction

// The polytope. Corners of a face are numbers of vertices, a byte each, counter-clockwise from outside.
vec3 vertex_w[max_vertices];
vec3 vertex_a[max_vertices];
uint vertices = 0u;
uint face_corners[max_faces];
vec4 face_planes[max_faces];  // unit normal, distance from the origin
uint faces = 0u;
// Edges of the faces that a new vertex removes: of each pair of bits, one edge is inside.
uvec2 edge_bits[max_vertices];
uint edges[3u * max_vertices];
uint edge_count = 0u;

uvec3 corners_of(uint face) {
  return uvec3(face_corners[face], face_corners[face] >> 8, face_corners[face] >> 16) & 0xFFu;
}

void add_vertex(Difference found) {
  vertex_w[vertices] = found.w;
  vertex_a[vertices] = found.a;
  ++vertices;
}

void add_face(uint i, uint j, uint k) {
  const vec3 normal = cross(vertex_w[j] - vertex_w[i], vertex_w[k] - vertex_w[i]);
  const float area = length(normal);
  // The distance is that of the corner that is nearest to the origin, which has the least rounding. A face
  // without area is never the nearest one.
  const vec3 n = normal / max(area, 1e-37);
  const vec3 w_i = vertex_w[i];
  const vec3 w_j = vertex_w[j];
  const vec3 w_k = vertex_w[k];
  const float i_square = dot(w_i, w_i);
  const float j_square = dot(w_j, w_j);
  const float k_square = dot(w_k, w_k);
  const vec3 nearest = i_square <= j_square && i_square <= k_square ? w_i : j_square <= k_square ? w_j : w_k;
  face_corners[faces] = i | j << 8 | k << 16;
  face_planes[faces] = vec4(n, area > 1e-30 ? dot(n, nearest) : 3.4e38);
  ++faces;
}

bool edge_bit(uint from, uint to) { return (edge_bits[from][to >> 5] >> (to & 31u) & 1u) != 0u; }

void flip_edge_bit(uint from, uint to) { edge_bits[from][to >> 5] ^= 1u << (to & 31u); }

// An edge that two removed faces share occurs in both directions and cancels.
void note_edge(uint from, uint to) {
  if (edge_bit(to, from)) {
    flip_edge_bit(to, from);
  } else {
    flip_edge_bit(from, to);
    edges[edge_count] = from | to << 8;
    ++edge_count;
  }
}

// The corners of a tetrahedron of support points, as large as simple choices make it. False: the difference
// has no volume along `flat_normal`.
bool make_tetrahedron(Hull first, Hull second, float least, out vec3 flat_normal) {
  float longest = -1.0;
  Difference low, high;
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
    vec3 d = vec3(0.0);
    d[axis] = 1.0;
    const Difference above = support_of_difference(first, second, d);
    const Difference below = support_of_difference(first, second, -d);
    const vec3 span = above.w - below.w;
    const bool is_longer = dot(span, span) > longest;
    longest = is_longer ? dot(span, span) : longest;
    if (is_longer) {
      low = below;
      high = above;
    }
  }
  add_vertex(low);
  add_vertex(high);
  const vec3 line = (high.w - low.w) / max(sqrt(longest), 1e-37);
  const vec3 across = normalize(cross(line, abs(line.x) < 0.6 ? vec3(1.0, 0.0, 0.0) : vec3(0.0, 1.0, 0.0)));
  const vec3 beside = cross(line, across);
  float widest = -1.0;
  Difference third;
  [[unroll]] for (uint k = 0u; k < 4u; ++k) {
    const vec3 d = (k & 2u) == 0u ? across : beside;
    const Difference found = support_of_difference(first, second, (k & 1u) == 0u ? d : -d);
    const vec3 off = cross(line, found.w - low.w);
    const bool is_wider = dot(off, off) > widest;
    widest = is_wider ? dot(off, off) : widest;
    if (is_wider) third = found;
  }
  add_vertex(third);
  const vec3 n = cross(line, third.w - low.w);
  flat_normal = n / max(length(n), 1e-37);
  const Difference above = support_of_difference(first, second, flat_normal);
  const Difference below = support_of_difference(first, second, -flat_normal);
  const float up = dot(flat_normal, above.w - low.w);
  const float down = dot(flat_normal, low.w - below.w);
  if (up >= down)
    add_vertex(above);
  else
    add_vertex(below);
  if (max(up, down) <= least) return false;
  // Seen from the fourth corner, the first three are counter-clockwise if it is below them.
  const bool is_above = up >= down;
  add_face(0u, is_above ? 2u : 1u, is_above ? 1u : 2u);
  add_face(0u, is_above ? 1u : 3u, is_above ? 3u : 1u);
  add_face(1u, is_above ? 2u : 3u, is_above ? 3u : 2u);
  add_face(2u, is_above ? 0u : 3u, is_above ? 3u : 0u);
  return true;
}

// The face that is nearest to the origin, or, if `n` is not zero, the one whose normal is nearest to n.
uint nearest_face(vec3 n) {
  const bool by_normal = n != vec3(0.0);
  uint best = 0u;
  float least = 3.4e38;
  uint f = 0u;
  do {
    ++rounds;
    if (f < faces) {
      const vec4 plane = face_planes[f];
      const float score = by_normal && plane.w < 3e38 ? -dot(plane.xyz, n) : plane.w;
      best = score < least ? f : best;
      least = min(score, least);
      ++f;
    }
  } while (f < faces);
  return best;
}

// The point of the first body at the point of the polytope that is nearest to `target`, among the faces whose
// normal has at least this cosine with n. Several faces may lie in one plane; of those, one contains that
// point.
vec3 first_point_near(vec3 target, vec3 n, float min_cosine, float limit) {
  float least = 3.4e38;
  vec3 a = vec3(0.0);
  uint f = 0u;
  do {
    ++rounds;
    if (f < faces) {
      const uvec3 c = corners_of(f);
      const vec4 plane = face_planes[f];
      const TrianglePoint nearest =
          nearest_on_triangle(vertex_w[c.x] - target, vertex_w[c.y] - target, vertex_w[c.z] - target);
      const bool is_nearer = plane.w <= limit && dot(plane.xyz, n) > min_cosine && nearest.square < least;
      least = is_nearer ? nearest.square : least;
      a = is_nearer ? (1.0 - nearest.u - nearest.v) * vertex_a[c.x] + nearest.u * vertex_a[c.y] +
                          nearest.v * vertex_a[c.z]
                    : a;
      ++f;
    }
  } while (f < faces);
  return a;
}

bool is_close(float lower, float upper, float enough) {
  return upper - lower <= max(enough, 0.01 * abs(upper));
}

// Replaces the faces that see the new vertex. False: rounding has broken the polytope.
bool expand(Difference found, float least) {
  const uint added = vertices;
  add_vertex(found);
  edge_count = 0u;
  uint i = 0u;
  do {
    ++rounds;
    if (i < added) edge_bits[i++] = uvec2(0u);
  } while (i < added);
  uint kept = 0u;
  uint f = 0u;
  bool fits = true;
  do {
    ++rounds;
    if (f < faces) {
      const vec4 plane = face_planes[f];
      const uvec3 corners = corners_of(f);
      // The corner nearest to the origin stands for the plane, so that both sides have the same rounding.
      const bool sees = dot(plane.xyz, found.w) - plane.w > least || plane.w > 3e38;
      fits = fits && edge_count + 3u <= 3u * max_vertices;
      if (sees && fits) {
        note_edge(corners.x, corners.y);
        note_edge(corners.y, corners.z);
        note_edge(corners.z, corners.x);
      } else {
        face_planes[kept] = plane;
        face_corners[kept] = face_corners[f];
        ++kept;
      }
      ++f;
    }
  } while (f < faces);
  faces = kept;
  uint border = 0u;
  uint e = 0u;
  do {
    ++rounds;
    if (e < edge_count) {
      const uint from = edges[e] & 0xFFu;
      const uint to = edges[e] >> 8;
      // An edge may be listed twice, when it was cancelled in between.
      if (edge_bit(from, to)) {
        flip_edge_bit(from, to);
        ++border;
        fits = fits && faces < max_faces;
        if (fits) add_face(from, to, added);
      }
      ++e;
    }
  } while (e < edge_count);
  return fits && border >= 3u;
}

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
  const uint index = deep[place];
  const PairRecord record = pairs[index];
  const Hull first = first_hull_of(record);
  const Hull second = second_hull_of(record);
  const float enough = max(1e-5 * record.size_m, record.rounding_m);

  PairResult result = PairResult(vec3(0.0), 0.0, vec3(0.0), pair_deep, 0.0, 0.0);
  vec3 flat_normal;
  bool goes_on = make_tetrahedron(first, second, 0.1 * enough, flat_normal);
  if (!goes_on) {
    // Two flat bodies in one plane touch.
    const vec3 turned = dot(flat_normal, record.center_m) < 0.0 ? -flat_normal : flat_normal;
    result.n = turned;
    result.point_m = support(first, -turned);
  }
  float upper = 3.4e38;
  float lower = -3.4e38;
  vec3 n = vec3(0.0);
  float depth = 0.0;  // along n
  // Bodies of revolution about one line have the same depth in many directions, and no polytope of this size
  // follows all of them. When the bounds are within 1 %, the search goes on in the best direction alone.
  bool is_local = false;
  bool converged = false;
  do {
    ++rounds;
    if (goes_on) {
      const vec4 plane = face_planes[nearest_face(is_local ? n : vec3(0.0))];
      const Difference found = support_of_difference(first, second, plane.xyz);
      const float height = dot(found.w, plane.xyz);
      const float slack = max(0.1 * enough, 1e-4 * abs(height));
      // The body ends at the face. In the best direction alone, that face may be far from the best depth.
      const bool is_on_face = height - plane.w <= slack;
      const bool is_best = height < upper || (is_on_face && height <= upper + slack);
      converged = is_on_face && is_best;
      n = is_best ? plane.xyz : n;
      depth = is_best ? height : depth;
      upper = min(upper, height);
      lower = is_local ? lower : max(lower, min(plane.w, height));
      is_local = is_local || (vertices >= max_vertices - local_vertices && is_close(lower, upper, enough));
      goes_on = !is_on_face && vertices < max_vertices && rounds < max_rounds - 4000u &&
                expand(found, 0.05 * enough);
    }
  } while (goes_on);
  if (n != vec3(0.0)) {
    result.state = converged || is_close(lower, upper, enough) ? pair_deep : pair_undecided;
    result.n = -n;
    result.distance_m = -depth;
    // Where the search ended early, no face has the normal n. Then all faces are searched: the result is
    // still a point of the first body, and the point of the second one beside it is near its surface.
    result.point_m =
        first_point_near(depth * n, n, converged ? 0.9999 : -2.0, converged ? depth + enough : 3e38);
    result.min_m = -upper;
    result.max_m = -min(lower, upper);
  }
  if (!loops_still_turn(args.loop_probe)) result.state = pair_unfinished;
  results[index] = result;
}
