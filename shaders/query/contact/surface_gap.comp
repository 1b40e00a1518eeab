#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The shortest segment from a near triangle to the other surface, or the point at which it crosses that
// surface, from the triangles themselves.
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
#include "query/contact/triangle_pair.glsl"
layout(set = 0, binding = 3, scalar) readonly buffer SidesBuffer { SurfaceSide sides[]; };
layout(set = 0, binding = 4, scalar) readonly buffer NearBuffer { NearTriangle near_triangles[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer GapsBuffer { SurfaceGap gaps[]; };

// The child whose box is nearest to the triangle's box; the others within reach are pushed.
uint nearest_child_to(uint node, vec3 scale, vec3 lo, vec3 hi) {
  const WideNode wide = fetch_wide_node(nodes, node);
  uint nearest = ref_none;
  float nearest_square = 3.4e38;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const vec3 apart = max(max(child_lo(wide, k) * scale - hi, lo - child_hi(wide, k) * scale), vec3(0.0));
    offer_child(child_reference(wide, k), dot(apart, apart), nearest, nearest_square);
  }
  return unless_full(nearest);
}

Triangle moved(Triangle t, vec3 by) { return Triangle(t.a + by, t.b + by, t.c + by, t.index); }

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) return;
  const NearTriangle near = near_triangles[index];
  const SurfaceSide side = sides[near.side];
  const Triangle placed_triangle = surface_triangle(side, first_slot_of(side.surface) + near.place);
  const vec3 lo = min(placed_triangle.a, min(placed_triangle.b, placed_triangle.c));
  const vec3 hi = max(placed_triangle.a, max(placed_triangle.b, placed_triangle.c));
  const vec3 center = center_of(placed_triangle);
  const Triangle surface = moved(placed_triangle, -center);

  const float reach = side.limit_m + 4.0 * side.rounding_m;
  float best = reach < 1e18 ? reach * reach : nowhere;
  box_limit = best * (1.0 + 2e-6);
  TriangleGap gap = TriangleGap(nowhere, vec3(0.0), vec3(0.0));
  uint best_triangle = no_triangle;
  uint best_slot = 0u;
  uint current = root_of(side.body);
  if (current != ref_none) do {
      rounds += 3u;  // this loop's, and one for each of the two inside
      if (is_inner(current)) current = nearest_child_to(current, side.body_scale, lo, hi);
      const bool is_leaf = current != ref_none && !is_inner(current);
      const uint first = current & ref_triangle_first_mask;
      const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
      uint k = 0u;
      if (is_leaf) do {
          ++rounds;
          if (k < count) {
            const Triangle of_body = body_triangle(side, first + k);
            const TriangleGap found = gap_between(surface, moved(of_body, -center));
            const bool better =
                found.square < best || (found.square == best && of_body.index < best_triangle);
            if (better) {
              gap = found;
              best = found.square;
              best_triangle = of_body.index;
              best_slot = first + k;
              // Triangles that cross end the search: any of them will do.
              box_limit = best > 0.0 ? best * (1.0 + 2e-6) : -1.0;
            }
            ++k;
          }
        } while (k < count);
      current = is_leaf ? ref_none : current;
      if (current == ref_none) current = next_waiting(0u);
      cut_short = cut_short || rounds > max_rounds;
    } while (current != ref_none && !cut_short);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);

  const bool found = best_triangle != no_triangle;
  const float distance = found ? sqrt(gap.square) : nowhere;
  const vec3 front = found ? front_of(body_triangle(side, best_slot)) : vec3(0.0, 0.0, 1.0);
  // The normal of the body's triangle, towards the centre of the surface's triangle; for segments too short
  // to have a direction.
  const vec3 towards_surface = dot(front, -gap.second) < 0.0 ? -front : front;
  const vec3 n =
      distance > side.rounding_m ? (gap.first - gap.second) / max(distance, 1e-37) : towards_surface;
  gaps[index] = SurfaceGap(center + 0.5 * (gap.first + gap.second), distance, n, surface.index,
                           found ? best_triangle : 0u, cut_short ? surface_unfinished : surface_ended);
}
