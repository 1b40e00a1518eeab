#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The distances of points to one geometry, and the gradients of these distances, in the frame of the
// geometry. Its distance field is built from them (rtstdb/field/field_build.hpp).
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
  const NearestSlot best = nearest_slot(args.root, vec3(1.0), wanted.point_m, wanted.radius_m, args.slack);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  const bool found = best.triangle != no_triangle;
  uint triangle;
  const vec3 away = -nearest_on_slot(best.slot, vec3(1.0), wanted.point_m, triangle).offset;
  const float distance_m = sqrt(best.square);
  // So near to the surface the direction to the nearest point is mere rounding; the normal replaces it.
  const vec3 magnitude = abs(wanted.point_m);
  const float blur = 1e-6 * max(max(magnitude.x, magnitude.y), magnitude.z);
  const vec3 n = args.front_sign * front_normal(best.slot);
  const vec3 beside = dot(n, away) < 0.0 ? -n : n;
  const vec3 gradient = distance_m > blur ? away / max(distance_m, 1e-37) : beside;
  samples[index] = FieldSample(cut_short ? vec3(0.0)
                               : found   ? gradient
                                         : vec3(0.0, 0.0, 1.0),
                               found ? distance_m : nowhere);
}
