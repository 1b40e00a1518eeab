#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The sign of distances by ray ratio (Wright 2015): rays start at the point in evenly spread directions; the
// point is inside if enough of them first hit a triangle from behind. For geometry that is not closed. Runs
// after field_distances.comp.
#include "common/loops.glsl"
#include "common/places.glsl"
#include "common/wide_node.glsl"
#include "query/ray/ray_triangle.glsl"
#include "shared/field.h"
#include "shared/query.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { FieldArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2, scalar) readonly buffer PointsBuffer { FieldPoint points[]; };
layout(set = 0, binding = 3, scalar) buffer SamplesBuffer { FieldSample samples[]; };

const float nowhere = 3.4e38;  // farther than anything

uint depth = 0u;
uint rounds = 0u;
bool cut_short = false;
float box_limit;
#include "query/nearest_first.glsl"

// A spiral of equal areas over the sphere.
vec3 direction_of(uint k) {
  const float count = float(field_sign_directions);
  const float z = 1.0 - (2.0 * float(k) + 1.0) / count;
  const float golden_angle = 2.39996323;
  const float turn = golden_angle * float(k);
  return vec3(sqrt(max(1.0 - z * z, 0.0)) * vec2(cos(turn), sin(turn)), z);
}

uint nearest_child_on_ray(uint node, Segment ray) {
  const WideNode wide = fetch_wide_node(nodes, node);
  uint nearest = ref_none;
  float nearest_bound = nowhere;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const vec3 at_lo = (child_lo(wide, k) + ray.minus_o) * ray.inverse_d;
    const vec3 at_hi = (child_hi(wide, k) + ray.minus_o) * ray.inverse_d;
    const vec3 blur = ray.blur_m * abs(ray.inverse_d);
    const vec3 enters = min(at_lo, at_hi) - blur;
    const vec3 leaves = max(at_lo, at_hi) + blur;
    const float first = max(max(enters.x, enters.y), max(enters.z, 0.0));
    const float last = min(leaves.x, min(leaves.y, leaves.z));
    offer_child(child_reference(wide, k), first <= last ? first : nowhere, nearest, nearest_bound);
  }
  return unless_full(nearest);
}

// Whether the first triangle on the ray shows its back.
bool hits_from_behind(vec3 point, vec3 direction) {
  const uvec4 head = texelFetch(nodes, int(args.root * node_texels));
  const vec3 quantum =
      vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
           uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
  const Segment ray = make_segment(-point, direction, blur_of(uintBitsToFloat(head.xyz) - point, quantum));
  Found best = nothing_within(nowhere);
  box_limit = nowhere * 0.99;
  depth = 0u;
  uint current = args.root;
  do {
    rounds += 3u;  // this loop's, and one for each of the two inside
    if (is_inner(current)) current = nearest_child_on_ray(current, ray);
    const bool is_leaf = current != ref_none && !is_inner(current);
    const uint first = current & ref_triangle_first_mask;
    const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
    uint k = 0u;
    if (is_leaf) do {
        ++rounds;
        if (k < count) {
          const int base = int((first + k) * triangle_texels);
          test_corners(ray, texelFetch(triangles, base), texelFetch(triangles, base + 1),
                       texelFetch(triangles, base + 2).xyz, first + k, 0.0, 0.0, 0u, 0u, best);
          box_limit = min(box_limit, reach_of(best));
          ++k;
        }
      } while (k < count);
    current = is_leaf ? ref_none : current;
    if (current == ref_none) current = next_waiting(0u);
    cut_short = cut_short || rounds > max_rounds;
  } while (current != ref_none && !cut_short);
  return best.status == status_hit && !best.front;
}

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  const vec3 point = points[index].point_m;
  uint from_behind = 0u;
  uint k = 0u;
  do {
    ++rounds;
    if (k < field_sign_directions) {
      const bool is_behind = hits_from_behind(point, direction_of(k));
      from_behind += is_behind ? 1u : 0u;
      ++k;
    }
  } while (k < field_sign_directions && !cut_short);
  const FieldSample found = samples[index];
  const bool is_inside =
      float(from_behind) >= args.inside_ratio * float(field_sign_directions) && found.distance_m > 0.0;
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  samples[index] = FieldSample(cut_short   ? vec3(0.0)
                               : is_inside ? -found.gradient
                                           : found.gradient,
                               is_inside ? -found.distance_m : found.distance_m);
}
