#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The depth of two convex bodies that touch or penetrate, in double precision: the expanding polytope
// algorithm (van den Bergen 2001). The polytope lies in the Minkowski difference. If the origin is inside,
// the least distance of a face from the origin is a lower bound of the depth; the support along the normal of
// a face is an upper bound, and a gap where it is negative. Of bodies that are apart by rounding alone, the
// stage before knows an upper bound of the distance.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer hulls;
layout(set = 0, binding = 1, scalar) readonly buffer PairsBuffer { PairRecord pairs[]; };
layout(set = 0, binding = 2, scalar) buffer ResultsBuffer { PairResult results[]; };
layout(set = 0, binding = 3, scalar) readonly buffer ListedBuffer { uint listed[]; };  // pairs by place

uint rounds = 0u;
#include "query/contact/hull.glsl"
#include "query/contact/result.glsl"
#include "query/contact/simplex.glsl"

const uint max_vertices = 128u;
const uint max_faces = 2u * max_vertices;  // a closed polytope of n vertices has 2 n - 4
const uint local_vertices = 32u;           // of them, for the search in the best direction
const uint faces_per_step = 4u;
const double double_rounding = 1.2e-16LF;  // upper bound of a rounding, relative
const uint reserved_rounds = 4000u;        // for the search for the point after the loop

// The polytope. The corners of a face are numbers of vertices, counter-clockwise from outside; its neighbours
// are the faces beyond the edges from the first to the second corner, and so on. A byte each.
dvec3 vertex_w[max_vertices];
dvec3 vertex_a[max_vertices];
uint vertices = 0u;
uint face_corners[max_faces];
uint face_neighbours[max_faces];
dvec3 face_normals[max_faces];     // unit
double face_distances[max_faces];  // from the origin; real_max: of a face without area
float face_roundings[max_faces];   // bounds of the errors of these distances
uint faces = 0u;

// Faces that see a new vertex and are removed, and the edges around them.
uint removed[max_faces];
uint removed_count = 0u;
uint is_removed[max_faces / 32u];  // a bit for each face
uint edges[max_vertices];          // from, to, the face beyond, and which of its edges; a byte each
uint edge_count = 0u;
uint edge_from[max_vertices];  // by vertex: the edge that begins there

uint byte_of(uint word, uint i) { return word >> 8u * i & 0xFFu; }

uint with_byte(uint word, uint i, uint value) { return word & ~(0xFFu << 8u * i) | value << 8u * i; }

void add_vertex(Difference found) {
  vertex_w[vertices] = found.w;
  vertex_a[vertices] = found.a;
  ++vertices;
}

void set_face(uint face, uvec3 corners, uvec3 neighbours) {
  const dvec3 i = vertex_w[corners.x];
  const dvec3 j = vertex_w[corners.y];
  const dvec3 k = vertex_w[corners.z];
  const dvec3 normal = cross(j - i, k - i);
  const double area = length(normal);
  const double longest = max(max(dot(j - i, j - i), dot(k - i, k - i)), dot(k - j, k - j));
  const dvec3 n = normal / max(area, real_tiny);
  // The distance is that of the corner that is nearest to the origin, which has the least rounding.
  const double i_square = dot(i, i);
  const double j_square = dot(j, j);
  const double k_square = dot(k, k);
  const dvec3 nearest = i_square <= j_square && i_square <= k_square ? i : j_square <= k_square ? j : k;
  face_corners[face] = corners.x | corners.y << 8 | corners.z << 16;
  face_neighbours[face] = neighbours.x | neighbours.y << 8 | neighbours.z << 16;
  face_normals[face] = n;
  face_distances[face] = area > 1e-14LF * longest ? dot(n, nearest) : real_max;
  // Rounding turns the normal of a thin triangle, and the plane turns about the corner nearest to the origin.
  const double angle = area > 1e-14LF * longest ? 8.0LF * double_rounding * longest / area : 0.0LF;
  face_roundings[face] = float(angle * sqrt(min(min(i_square, j_square), k_square)));
}

// The corners of a tetrahedron of support points, as large as simple choices make it. False: the difference
// has no volume along `flat_normal`.
bool make_tetrahedron(Hull first, Hull second, double least, out dvec3 flat_normal) {
  double longest = -1.0LF;
  Difference low, high;
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
    dvec3 d = dvec3(0.0LF);
    d[axis] = 1.0LF;
    const Difference above = support_of_difference(first, second, d);
    const Difference below = support_of_difference(first, second, -d);
    const dvec3 span = above.w - below.w;
    const bool is_longer = dot(span, span) > longest;
    longest = is_longer ? dot(span, span) : longest;
    if (is_longer) {
      low = below;
      high = above;
    }
  }
  add_vertex(low);
  add_vertex(high);
  const dvec3 line = (high.w - low.w) / max(sqrt(longest), real_tiny);
  const dvec3 across =
      normalize(cross(line, abs(line.x) < 0.6LF ? dvec3(1.0LF, 0.0LF, 0.0LF) : dvec3(0.0LF, 1.0LF, 0.0LF)));
  const dvec3 beside = cross(line, across);
  double widest = -1.0LF;
  Difference third;
  // Along four directions across the line, and then along the widest of these.
  dvec3 off = dvec3(0.0LF);
  [[unroll]] for (uint k = 0u; k < 6u; ++k) {
    const dvec3 toward = k < 4u ? ((k & 2u) == 0u ? across : beside) : off / max(length(off), real_tiny);
    const Difference found = support_of_difference(first, second, (k & 1u) == 0u ? toward : -toward);
    const dvec3 span = found.w - low.w;
    const dvec3 beyond = span - dot(span, line) * line;
    const bool is_wider = dot(beyond, beyond) > widest;
    widest = is_wider ? dot(beyond, beyond) : widest;
    if (is_wider) {
      third = found;
      off = beyond;
    }
  }
  add_vertex(third);
  const dvec3 n = cross(line, off);
  flat_normal = n / max(length(n), real_tiny);
  const Difference above = support_of_difference(first, second, flat_normal);
  const Difference below = support_of_difference(first, second, -flat_normal);
  const double up = dot(flat_normal, above.w - low.w);
  const double down = dot(flat_normal, low.w - below.w);
  const bool is_above = up >= down;
  if (is_above)
    add_vertex(above);
  else
    add_vertex(below);
  if (max(up, down) <= least) return false;
  // Seen from the fourth corner, the first three are counter-clockwise if it is below them.
  set_face(0u, uvec3(0u, is_above ? 2u : 1u, is_above ? 1u : 2u),
           uvec3(is_above ? 3u : 1u, 2u, is_above ? 1u : 3u));
  set_face(1u, uvec3(0u, is_above ? 1u : 3u, is_above ? 3u : 1u),
           uvec3(is_above ? 0u : 3u, 2u, is_above ? 3u : 0u));
  set_face(2u, uvec3(1u, is_above ? 2u : 3u, is_above ? 3u : 2u),
           uvec3(is_above ? 0u : 1u, 3u, is_above ? 1u : 0u));
  set_face(3u, uvec3(2u, is_above ? 0u : 3u, is_above ? 3u : 0u),
           uvec3(is_above ? 0u : 2u, 1u, is_above ? 2u : 0u));
  faces = 4u;
  return true;
}

// The face that is nearest to the origin, or, if `is_local`, the one whose normal is nearest to n.
uint nearest_face(bool is_local, dvec3 n) {
  uint best = 0u;
  double least = real_max;
  uint f = 0u;
  do {
    ++rounds;
    if (f < faces) {
      [[unroll]] for (uint k = 0u; k < faces_per_step; ++k) {
        const uint face = min(f + k, max_faces - 1u);
        const double distance = face_distances[face] - double(face_roundings[face]);
        const double score = is_local && distance < real_max ? -dot(face_normals[face], n) : distance;
        const bool is_nearer = f + k < faces && score < least;
        best = is_nearer ? face : best;
        least = is_nearer ? score : least;
      }
      f += faces_per_step;
    }
  } while (f < faces);
  return best;
}

// The point of the first body at the point of the polytope that is nearest to `target`.
dvec3 first_point_near(dvec3 target) {
  double least = real_max;
  dvec3 a = dvec3(0.0LF);
  uint f = 0u;
  do {
    ++rounds;
    if (f < faces) {
      const uint word = face_corners[f];
      const uvec3 c = uvec3(byte_of(word, 0u), byte_of(word, 1u), byte_of(word, 2u));
      const NearestOfTriangle nearest =
          nearest_of_triangle(vertex_w[c.x] - target, vertex_w[c.y] - target, vertex_w[c.z] - target);
      const bool is_nearer = nearest.square < least;
      least = is_nearer ? nearest.square : least;
      a = is_nearer ? nearest.weights.x * vertex_a[c.x] + nearest.weights.y * vertex_a[c.y] +
                          nearest.weights.z * vertex_a[c.z]
                    : a;
      ++f;
    }
  } while (f < faces);
  return a;
}

void remove_face(uint face) {
  removed[removed_count++] = face;
  is_removed[face >> 5] |= 1u << (face & 31u);
}

// Finds the faces that see the point, beginning with one of them and going on over neighbours, and the edges
// around these faces.
void find_visible(uint visible, dvec3 w, double least) {
  [[unroll]] for (uint i = 0u; i < max_faces / 32u; ++i) is_removed[i] = 0u;
  removed_count = 0u;
  edge_count = 0u;
  remove_face(visible);
  uint next = 0u;
  do {
    ++rounds;
    if (next < removed_count) {
      const uint face = removed[next];
      const uint neighbours = face_neighbours[face];
      [[unroll]] for (uint k = 0u; k < 3u; ++k) {
        const uint beside = byte_of(neighbours, k);
        if ((is_removed[beside >> 5] >> (beside & 31u) & 1u) == 0u) {
          const double distance = face_distances[beside];
          if (dot(face_normals[beside], w) - distance > least || distance == real_max) remove_face(beside);
        }
      }
      ++next;
    }
  } while (next < removed_count);
  next = 0u;
  do {
    ++rounds;
    if (next < removed_count) {
      const uint face = removed[next];
      const uint corners = face_corners[face];
      const uint neighbours = face_neighbours[face];
      [[unroll]] for (uint k = 0u; k < 3u; ++k) {
        const uint beside = byte_of(neighbours, k);
        const uint from = byte_of(corners, k);
        const uint to = byte_of(corners, (k + 1u) % 3u);
        const bool is_border = (is_removed[beside >> 5] >> (beside & 31u) & 1u) == 0u;
        if (is_border && edge_count < max_vertices) {
          // The edge of the face beyond begins where this one ends.
          const uint of_beside = face_corners[beside];
          const uint which = byte_of(of_beside, 0u) == to ? 0u : byte_of(of_beside, 1u) == to ? 1u : 2u;
          edge_from[from] = edge_count;
          edges[edge_count++] = from | to << 8 | beside << 16 | which << 24;
        }
      }
      ++next;
    }
  } while (next < removed_count);
}

// The place of a new face: that of a removed one, or behind the last.
uint place_of_new(uint i) { return i < removed_count ? removed[i] : faces + i - removed_count; }

// Replaces the faces that see the new vertex by faces between it and their border. False: there is no room,
// or rounding has made the border more than one loop; the polytope is then as before.
bool expand(Difference found, uint visible, double least) {
  find_visible(visible, found.w, least);
  bool is_loop = edge_count >= 3u && edge_count == removed_count + 2u &&
                 faces + edge_count - removed_count <= max_faces && vertices < max_vertices;
  // Whether the edges are one loop: it returns to its first edge after all of them and not before.
  uint edge = 0u;
  uint i = 0u;
  do {
    ++rounds;
    if (is_loop && i < edge_count) {
      const uint end = byte_of(edges[edge], 1u);
      edge = min(edge_from[end], edge_count - 1u);
      ++i;
      is_loop = byte_of(edges[edge], 0u) == end && (edge == 0u) == (i == edge_count);
    }
  } while (is_loop && i < edge_count);
  if (is_loop) {
    const uint added = vertices;
    add_vertex(found);
    uint count = 0u;
    edge = 0u;
    do {
      ++rounds;
      if (count < edge_count) {
        const uint word = edges[edge];
        const uint beside = byte_of(word, 2u);
        const uint place = place_of_new(count);
        const uint before = place_of_new(count > 0u ? count - 1u : edge_count - 1u);
        const uint behind = place_of_new(count + 1u < edge_count ? count + 1u : 0u);
        set_face(place, uvec3(byte_of(word, 0u), byte_of(word, 1u), added), uvec3(beside, behind, before));
        face_neighbours[beside] = with_byte(face_neighbours[beside], byte_of(word, 3u), place);
        edge = edge_from[byte_of(word, 1u)];
        ++count;
      }
    } while (count < edge_count);
    faces += edge_count - removed_count;
  }
  return is_loop;
}

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
  const uint index = listed[place];
  const PairRecord record = pairs[index];
  const PairResult prior = results[index];
  const Hull first = first_hull_of(record);
  const Hull second = second_hull_of(record);
  const double skins = first.skin + second.skin;
  const double rounding = rounding_of(record);
  const bool is_curved = (first.round_radius > 0.0LF && first.skin == 0.0LF) ||
                         (second.round_radius > 0.0LF && second.skin == 0.0LF);

  dvec3 n;
  bool goes_on = make_tetrahedron(first, second, rounding, n);
  const bool is_flat = !goes_on;
  // Two flat bodies in one plane touch along its normal.
  if (dot(n, first.center) < 0.0LF) n = -n;
  double upper = is_flat ? 0.0LF : real_max;  // of the depth, along -n
  double lower = -real_max;
  bool is_local = false;
  do {
    ++rounds;
    if (goes_on) {
      const uint face = nearest_face(is_local, -n);
      const dvec3 outward = face_normals[face];
      const double distance = face_distances[face];
      const Difference found = support_of_difference(first, second, outward);
      const double height = dot(found.w, outward);
      // The body ends at the face. In the best direction alone, that face may be far from the least depth.
      const bool is_end = height - distance <= 0.1LF * rounding && height <= upper + 0.1LF * rounding;
      lower = is_local ? lower : max(lower, min(distance - double(face_roundings[face]), height));
      n = height < upper ? -outward : n;
      upper = min(upper, height);
      // Curved bodies may have nearly the same depth in more directions than the polytope can follow. When
      // the bounds are within 1 %, the search goes on in the best direction alone.
      is_local = is_local || (vertices >= max_vertices - local_vertices && lower > 0.99LF * upper);
      goes_on = !is_end && distance < real_max && rounds < max_rounds - reserved_rounds &&
                expand(found, face, 0.01LF * rounding);
    }
  } while (goes_on);
  dvec3 point = is_flat ? support(first, -n) : first_point_near(-upper * n);
  if (is_curved) {
    const dvec3 refined = refined_by_axis(first, second, n);
    const double gap = gap_along(first, second, refined);
    n = gap > -upper ? refined : n;
    upper = min(upper, -gap);
  }

  double min_m = -upper - rounding - skins - double(record.omitted_m);
  double max_m = min(double(prior.max_m), lower > rounding ? rounding - lower - skins : real_max);
  // Bounds of the stage before may be better where the bodies are apart.
  const bool is_prior_better = double(prior.min_m) > min_m;
  n = is_prior_better ? dvec3(prior.n) : n;
  point = is_prior_better ? dvec3(prior.point_m) : point - first.skin * n;
  const double distance = is_prior_better ? double(prior.distance_m) : -upper - skins;
  min_m = max(min_m, double(prior.min_m));
  max_m = max(min_m, max_m);
  PairResult result = result_of(n, point, distance, min_m, max_m);
  const double width = max(double(record.precision_m), distance < 0.0LF ? -0.01LF * distance : 0.0LF);
  result.state = max_m - min_m <= width ? pair_known : pair_undecided;
  // A retry needs the bounds of the stage before.
  if (loops_still_turn(args.loop_probe))
    results[index] = result;
  else
    results[index].state = pair_unfinished;
}
