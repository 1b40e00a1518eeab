#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Whether a near triangle lies in the other body, and the begin of the search for its deepest point.
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
layout(set = 0, binding = 5, scalar) readonly buffer GapsBuffer { SurfaceGap gaps[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer DepthsBuffer { SurfaceDepth depths[]; };

// Whether the end of a gap on the other surface lies inside the surface's own body.
bool ends_in_surface(SurfaceSide side, SurfaceGap gap) {
  if (!is_closed(side.surface)) return false;
  const vec3 end = gap.point_m - 0.5 * gap.distance_m * gap.n;
  const Winding around = winding_around(root_of(side.surface),
                                        rotate(conjugate(side.q), end - side.origin_m) / side.surface_scale);
  rounds += around.rounds;
  cut_short = cut_short || around.cut_short;
  return around.number != 0;
}

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) return;
  const NearTriangle near = near_triangles[index];
  const SurfaceSide side = sides[near.side];
  const Triangle t = surface_triangle(side, first_slot_of(side.surface) + near.place);
  const SurfaceGap gap = gaps[index];
  const bool crosses = gap.distance_m == 0.0;
  // A triangle that does not cross the body's surface lies inside or outside as a whole.
  const bool is_inside = is_closed(side.body) && is_in_body(side, t.a);
  const bool has_depth = is_closed(side.body) && (crosses || is_inside);
  const bool is_gap = !crosses && !is_inside && gap.distance_m <= side.limit_m;
  const uint where = is_inside                              ? triangle_inside
                     : is_gap && ends_in_surface(side, gap) ? triangle_gap_in_body
                                                            : triangle_outside;
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  const uint state = cut_short ? surface_unfinished : has_depth ? surface_goes_on : surface_ended;
  const vec3 up = vec3(0.0, 0.0, 1.0);
  depths[index] = SurfaceDepth(vec4(t.a, 0.0), vec4(t.b, 0.0), vec4(t.c, 0.0), vec4(t.a, 0.0), up, 0.0, 0.0,
                               up, 0u, 0u, 0u, t.index, where, state);
}
