#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The distances of points to one geometry, and the gradients of these distances, in the frame of the
// geometry: from them its distance field is built (rtstdb/field/field_build.hpp).
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/field.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { FieldArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2, scalar) readonly buffer PointsBuffer { FieldPoint points[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer SamplesBuffer { FieldSample samples[]; };

uint depth = 0u;
uint rounds = 0u;
bool cut_short = false;
float box_limit;
#include "query/nearest_first.glsl"
#include "query/nearest/geometry.glsl"

const float nowhere = 3.4e38;  // farther than anything

struct NearestSlot {
  float square;
  uint triangle;
  uint slot;
};

// At equal distances the triangle with the lower index counts, so that the gradient does not depend on the
// order in which boxes are visited.
NearestSlot nearest_slot(vec3 point, float radius) {
  NearestSlot best = NearestSlot(radius * radius, 0xFFFFFFFFu, 0u);
  box_limit = best.square * (1.0 + 2e-6);
  uint current = args.root;
  do {
    rounds += 3u;  // this loop's, and one for each of the two inside
    if (is_inner(current)) current = nearest_triangle_child(current, vec3(1.0), point);
    const bool is_leaf = current != ref_none && !is_inner(current);
    const uint first = current & ref_triangle_first_mask;
    const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
    uint k = 0u;
    if (is_leaf) do {
        ++rounds;
        if (k < count) {
          uint triangle;
          const float square = nearest_on_slot(first + k, vec3(1.0), point, triangle).square;
          const bool better = square < best.square || (square == best.square && triangle < best.triangle);
          best.square = better ? square : best.square;
          best.triangle = better ? triangle : best.triangle;
          best.slot = better ? first + k : best.slot;
          box_limit = best.square * (1.0 + 2e-6);
          ++k;
        }
      } while (k < count);
    current = is_leaf ? ref_none : current;
    if (current == ref_none) current = next_waiting(0u);
    cut_short = cut_short || rounds > max_rounds;
  } while (current != ref_none && !cut_short);
  return best;
}

vec3 front_normal(uint slot) {
  const int base = int(slot * triangle_texels);
  const vec3 a = texelFetch(triangles, base).xyz;
  const vec3 n = cross(texelFetch(triangles, base + 1).xyz - a, texelFetch(triangles, base + 2).xyz - a);
  const float size = max(max(abs(n.x), abs(n.y)), abs(n.z));
  return size > 0.0 ? normalize(n / size) : vec3(0.0, 0.0, 1.0);
}

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  const FieldPoint wanted = points[index];
  const NearestSlot best = nearest_slot(wanted.point_m, wanted.radius_m);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  const bool found = best.triangle != 0xFFFFFFFFu;
  uint triangle;
  const vec3 away = -nearest_on_slot(best.slot, vec3(1.0), wanted.point_m, triangle).offset;
  const float distance_m = sqrt(best.square);
  // Next to the surface rounding decides the direction to the nearest point.
  const vec3 magnitude = abs(wanted.point_m);
  const float blur = 1e-6 * max(max(magnitude.x, magnitude.y), magnitude.z);
  const vec3 n = args.outward * front_normal(best.slot);
  const vec3 beside = dot(n, away) < 0.0 ? -n : n;
  const vec3 gradient = distance_m > blur ? away / max(distance_m, 1e-37) : beside;
  samples[index] = FieldSample(cut_short ? vec3(0.0)
                               : found   ? gradient
                                         : vec3(0.0, 0.0, 1.0),
                               found ? distance_m : nowhere);
}
