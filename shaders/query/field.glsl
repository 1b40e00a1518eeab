// Reads and evaluates the distance field of a geometry (shaders/shared/field.h). Mirrors
// rtstdb/field/stored_field.cpp.
//
// Included after the binding `fields`.
#ifndef RTSTDB_QUERY_FIELD_GLSL
#define RTSTDB_QUERY_FIELD_GLSL
#include "common/octahedron.glsl"
#include "shared/field.h"

struct DistanceField {
  vec3 origin;
  float edge;  // of a coarse cell
  uvec3 cells;
  uint first_cell;  // texels
  uint first_coarse;
  uint first_brick;
};

DistanceField fetch_field(uint texel) {
  const uvec4 t0 = texelFetch(fields, int(texel));
  const uvec4 t2 = texelFetch(fields, int(texel) + 2);
  return DistanceField(uintBitsToFloat(t0.xyz), uintBitsToFloat(t0.w), texelFetch(fields, int(texel) + 1).xyz,
                       t2.x, t2.y, t2.z);
}

bool is_signed_field(uint texel) { return texelFetch(fields, int(texel) + 1).w != 0u; }

// The edge of a cell in a brick.
float brick_cell_edge(DistanceField field) { return field.edge / float(field_brick_cells); }

// The sums over the vertices of a cell, whose edge is `edge`.
struct FieldSums {
  float planes;
  float steps;
  vec3 gradient;
  float edge;
};

// `from`: from the vertex to the point.
void add_vertex(uvec2 vertex, vec3 from, float weight, bool keeps_sign, inout FieldSums sums) {
  const float at_vertex = uintBitsToFloat(vertex.x);
  const vec3 outwards = unpacked_direction(vertex.y);
  const vec3 gradient = !keeps_sign && at_vertex < 0.0 ? -outwards : outwards;
  const float along = dot(gradient, from);
  const float plane = (keeps_sign ? at_vertex : abs(at_vertex)) + along;
  // The side of the vertex' plane on which the point lies.
  const float side = !keeps_sign && plane < 0.0 ? -weight : weight;
  sums.planes += side * plane;
  sums.steps += side * along;
  sums.gradient += side * gradient;
}

// The sums at a point of the grid, which is given in coarse cells from the origin.
FieldSums sums_at(DistanceField field, vec3 in_cells, bool keeps_sign) {
  const uvec3 coarse = min(uvec3(in_cells), field.cells - 1u);
  const uint number = (coarse.z * field.cells.y + coarse.y) * field.cells.x + coarse.x;
  const uvec4 four = texelFetch(fields, int(field.first_cell + (number >> 2)));
  const uint low = (number & 1u) != 0u ? four.y : four.x;
  const uint high = (number & 1u) != 0u ? four.w : four.z;
  const uint brick = (number & 2u) != 0u ? high : low;
  const bool is_fine = brick != field_none;
  const vec3 in_brick = float(field_brick_cells) * (in_cells - vec3(coarse));
  const uvec3 in_brick_cell = min(uvec3(max(in_brick, vec3(0.0))), uvec3(field_brick_cells - 1u));
  const uvec3 lowest = is_fine ? in_brick_cell : coarse;
  const vec3 at = clamp((is_fine ? in_brick : in_cells) - vec3(lowest), 0.0, 1.0);
  const float edge = is_fine ? brick_cell_edge(field) : field.edge;
  // Rows of vertices begin with a texel of their own.
  const uint row_texels = is_fine ? field_brick_vertices / 2u : (field.cells.x + 2u) / 2u;
  const uint rows = is_fine ? field_brick_vertices : field.cells.y + 1u;
  const uint first = is_fine ? field.first_brick + brick * field_brick_texels : field.first_coarse;
  const bool is_odd = (lowest.x & 1u) != 0u;
  FieldSums sums = FieldSums(0.0, 0.0, vec3(0.0), edge);
  [[unroll]] for (uint k = 0u; k < 4u; ++k) {
    const uvec2 yz = uvec2(k & 1u, k >> 1);
    const uint row = first + ((lowest.z + yz.y) * rows + lowest.y + yz.x) * row_texels;
    const int texel = int(row + (lowest.x >> 1));
    const uvec4 even_pair = texelFetch(fields, texel);
    const uvec4 odd_pair = texelFetch(fields, texel + (is_odd ? 1 : 0));
    const vec2 weights = mix(vec2(1.0) - at.yz, at.yz, vec2(yz));
    const float weight = weights.x * weights.y;
    const vec3 from = edge * (at - vec3(0.0, yz));
    add_vertex(is_odd ? even_pair.zw : even_pair.xy, from, weight * (1.0 - at.x), keeps_sign, sums);
    add_vertex(is_odd ? odd_pair.xy : even_pair.zw, from - vec3(edge, 0.0, 0.0), weight * at.x, keeps_sign,
               sums);
  }
  return sums;
}

float blended(FieldSums sums, float agreement) {
  return sums.planes - 0.5 * min(2.0 * agreement, 1.0) * sums.steps;
}

// A lower bound of the distance from a point of the grid to the surface, which may be negative. The point is
// given in coarse cells from the origin. The blend may be too large by up to a third of the cell's edge near
// sharp edges, where gradients disagree; so the bound is lower than the blend, the more they disagree.
float free_distance(DistanceField field, vec3 in_cells) {
  const FieldSums sums = sums_at(field, in_cells, false);
  const float agreement = dot(sums.gradient, sums.gradient);
  return blended(sums, agreement) - sums.edge * (0.8 * max(1.0 - agreement, 0.0) + 0.05);
}

// The blend with its sign, of a field that has one (is_signed_field).
struct SignedDistance {
  float distance;
  vec3 outwards;  // its gradient: unit
  bool is_fine;   // of a brick
};

SignedDistance signed_distance(DistanceField field, vec3 in_cells) {
  const FieldSums sums = sums_at(field, in_cells, true);
  const float agreement = dot(sums.gradient, sums.gradient);
  return SignedDistance(blended(sums, agreement), sums.gradient / max(sqrt(agreement), 1e-20),
                        sums.edge < field.edge);
}

#endif
