#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Some samples of each search for the deepest point of a near triangle: its corners, a point within, then a
// descent from the deepest of these (after Macklin et al., "Local Optimization for Robust Signed Distance
// Field Collision", 2020). Where a search pauses does not change its result.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer geometries;
layout(set = 0, binding = 3) uniform usamplerBuffer fields;
#include "query/contact/surface.glsl"
#include "query/contact/signed_distance.glsl"
#include "query/field.glsl"
#include "query/contact/surface_sample.glsl"
layout(set = 0, binding = 4, scalar) readonly buffer SidesBuffer { SurfaceSide sides[]; };
layout(set = 0, binding = 5, scalar) readonly buffer NearBuffer { NearTriangle near_triangles[]; };
layout(set = 0, binding = 6, scalar) readonly buffer GapsBuffer { SurfaceGap gaps[]; };
layout(set = 0, binding = 7, scalar) buffer DepthsBuffer { SurfaceDepth depths[]; };
layout(set = 0, binding = 8, scalar) readonly buffer ActiveBuffer { uint active_depths[]; };  // by place

// Visits of nodes and triangles after which a search pauses until the next dispatch: in the middle of a body,
// which has many nearest triangles, one sample may need thousands.
const uint visits_until_pause = 500u;

// More than twice the error of a field's distance near the surface, relative to the radius of the body.
const float field_slack = 0.01;

// Half the diagonal of the body's box.
float body_radius(SurfaceSide side) {
  return length(uintBitsToFloat(texelFetch(geometries, int(side.body * geometry_texels) + 1).xyz) *
                side.body_scale);
}

vec3 nearest_of(Triangle t, vec3 point) {
  return point + nearest_on_triangle(t.a - point, t.b - point, t.c - point).offset;
}

void take(Sample found, inout SurfaceDepth depth) {
  depth.deepest = vec4(found.point, -found.distance);
  depth.outwards = found.outwards;
}

// One of the samples before the descent: a corner, or `inner`. If a point moves by d, its distance from a
// surface changes by at most d; so a sample bounds the depth in the triangle.
void sample_triangle(SurfaceSide side, DistanceSource source, Triangle t, vec3 inner, float radius,
                     inout SurfaceDepth depth) {
  const uint i = depth.samples;
  const Sample found = sample_at(side, source, i == 0u ? t.a : i == 1u ? t.b : i == 2u ? t.c : inner);
  if (i == 0u) depth.corner_0.w = -found.distance;
  if (i == 1u) depth.corner_1.w = -found.distance;
  if (i == 2u) depth.corner_2.w = -found.distance;
  // A descent from a corner needs fewer steps where both are about as deep.
  const float clearly = i == 3u ? 1e-3 * radius : 0.0;
  if (i == 0u || -found.distance > depth.deepest.w + clearly) take(found, depth);
  const float max_depth = farthest_from(t, found.point) - found.distance +
                          (source.has_field ? field_slack * body_radius(side) : 4.0 * side.rounding_m);
  depth.max_depth_m = i == 0u ? max_depth : min(depth.max_depth_m, max_depth);
}

// A step of the descent, within the plane of the triangle, whose normal is n. If a step against the gradient
// leads upwards, the next one goes along the shortest vector between the gradients at both points, so that
// the search follows a valley; if that does not help either, the step is halved.
void descend(SurfaceSide side, DistanceSource source, Triangle t, vec3 n, inout SurfaceDepth depth) {
  const vec3 gradient = depth.outwards - n * dot(n, depth.outwards);
  const vec3 rejected = depth.rejected_outwards - n * dot(n, depth.rejected_outwards);
  const bool follows_valley = depth.follows_valley != 0u;
  const vec3 between = rejected - gradient;
  const float share = clamp(-dot(gradient, between) / max(dot(between, between), 1e-37), 0.0, 1.0);
  const vec3 up = follows_valley ? gradient + share * between : gradient;
  const float slope = length(up);
  const bool is_flat = slope < 1e-3;  // no direction is known to lead downwards
  Sample trial = Sample(depth.deepest.xyz, -depth.deepest.w, depth.rejected_outwards);
  if (!is_flat) trial = sample_at(side, source, nearest_of(t, depth.deepest.xyz - up / slope * depth.step_m));
  const bool is_deeper = -trial.distance > depth.deepest.w;
  depth.step_m *= is_deeper ? 1.5 : follows_valley ? 0.5 : 1.0;
  depth.follows_valley = !is_deeper && !follows_valley ? 1u : 0u;
  if (is_deeper)
    take(trial, depth);
  else
    depth.rejected_outwards = trial.outwards;
}

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end) return;
  if (skips_when_halted(args.halt, place + args.halt_from)) return;
  const uint index = active_depths[place];
  const NearTriangle near = near_triangles[index];
  const SurfaceSide side = sides[near.side];
  const Triangle t = surface_triangle(side, first_slot_of(side.surface) + near.place);
  const vec3 n = front_of(t);
  const vec3 center = center_of(t);
  const float radius = farthest_from(t, center);
  const SurfaceGap gap = gaps[index];
  const bool crosses = gap.distance_m == 0.0;
  SurfaceDepth depth = depths[index];
  // A halted stage is repeated for some searches.
  if (depth.state == surface_ended) return;
  const bool is_refined = depth.is_refined != 0u;
  const DistanceSource source = source_of(side, !is_refined, !crosses);
  const bool descends = depth.samples >= descent_samples;
  const uint steps = source.has_field ? max_field_descent_steps : max_triangle_descent_steps;
  const uint samples = descends ? descent_samples + steps : descent_samples;
  bool goes_on = true;
  do {
    ++rounds;
    if (goes_on) {
      if (!descends) {
        sample_triangle(side, source, t, crosses ? gap.point_m : center, radius, depth);
      } else {
        if (depth.samples == descent_samples) {
          depth.step_m =
              is_refined ? 0.1 * min(radius, depth.deepest.w) : 0.5 * min(radius, body_radius(side));
          depth.rejected_outwards = depth.outwards;
          depth.follows_valley = 0u;
        }
        descend(side, source, t, n, depth);
      }
      ++depth.samples;
      const bool is_small = descends && depth.step_m <= 4.0 * side.rounding_m;
      const bool ends = depth.samples >= samples || is_small;
      depth.state = ends ? surface_ended : surface_goes_on;
      goes_on = !ends && visits < visits_until_pause && !cut_short;
    }
  } while (goes_on);
  // An exact depth, so that the field's error does not decide which triangle is the deepest.
  if (descends && depth.state == surface_ended && source.has_field)
    take(sample_exactly(side, source, depth.deepest.xyz), depth);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  // Samples of a search that was cut short are taken again.
  if (cut_short)
    depths[index].state = surface_unfinished;
  else
    depths[index] = depth;
}
