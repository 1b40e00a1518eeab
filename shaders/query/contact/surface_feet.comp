#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The exact depths of the points that were chosen as contacts, and the nearest points of the other surface.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer geometries;
#include "query/contact/surface.glsl"
#include "query/contact/signed_distance.glsl"
layout(set = 0, binding = 3, scalar) readonly buffer SidesBuffer { SurfaceSide sides[]; };
layout(set = 0, binding = 4, scalar) readonly buffer NearBuffer { NearTriangle near_triangles[]; };
layout(set = 0, binding = 5, scalar) readonly buffer PointsBuffer { SurfacePoint points[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer FeetBuffer { SurfaceFoot feet[]; };

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) return;
  const SurfacePoint point = points[index];
  const SurfaceSide side = sides[near_triangles[point.near].side];
  const Foot foot = foot_of(side, point.point_m, is_in_body(side, point.point_m));
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  feet[index] =
      SurfaceFoot(foot.is_inside ? foot.distance : -foot.distance, point.point_m + foot.offset, foot.outwards,
                  fetch_triangle(foot.slot).index, cut_short ? surface_unfinished : surface_ended);
}
