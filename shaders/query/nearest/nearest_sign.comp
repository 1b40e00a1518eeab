#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The sign of each neighbor's distance: whether the entity's closed surface winds around the point. A
// vertical ray in the entity's frame starts at the point; each triangle that it crosses counts with the sign
// of its side. This needs the triangles alone and does not depend on the entity's scale, unlike
// angle-weighted pseudonormals (Baerentzen and Aanaes 2005).
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "common/wide_node.glsl"
#include "query/nearest/point.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { NearestArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2, scalar) readonly buffer PointsBuffer { NearestRecord points[]; };
layout(set = 0, binding = 3, scalar) buffer CountsBuffer { NearestCount counts[]; };
layout(set = 0, binding = 4) uniform samplerBuffer triangles;
layout(set = 0, binding = 5, scalar) readonly buffer PlacesBuffer { uint places[]; };

layout(buffer_reference, buffer_reference_align = 8, scalar) buffer Neighbors { NeighborRecord records[]; };

const uint stack_size = 128u;
// Every inner node pushes at most 8 references.
const uint stack_limit = stack_size - 8u;

// The winding of an edge around the origin, seen from above: +1 or -1 where it crosses the half line towards
// +y, by its direction. The reversed edge gives exactly the opposite, so over a closed surface the sum is
// right also where the vertical ray meets edges and corners.
int crossing(vec2 a, vec2 b) {
  precise float side = a.x * b.y - a.y * b.x;
  const bool leftwards = a.x > 0.0 && b.x <= 0.0;
  const bool rightwards = a.x <= 0.0 && b.x > 0.0;
  return (leftwards && side > 0.0 ? 1 : 0) - (rightwards && side < 0.0 ? 1 : 0);
}

float twice_area(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }

// The winding of a triangle around the vertical ray above the point.
int winding_above(vec3 a, vec3 b, vec3 c) {
  const float wa = twice_area(b.xy, c.xy);
  const float wb = twice_area(c.xy, a.xy);
  const float wc = twice_area(a.xy, b.xy);
  // The height at which the ray crosses, clamped to the corners' heights: rounding may move it far off for a
  // steep triangle.
  const float sum = wa + wb + wc;
  const float height = (wa * a.z + wb * b.z + wc * c.z) / (sum == 0.0 ? 1.0 : sum);
  const float clamped = clamp(height, min(a.z, min(b.z, c.z)), max(a.z, max(b.z, c.z)));
  const int winding = crossing(a.xy, b.xy) + crossing(b.xy, c.xy) + crossing(c.xy, a.xy);
  return clamped > 0.0 ? winding : 0;
}

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  const uint point_index = index / args.k;
  const NearestRecord record = points[point_index];
  const uint rank = index % args.k;
  if (rank >= counts[record.place].found || skips_when_halted(args.halt, point_index + args.halt_from))
    return;
  const uint neighbor = record.place * args.k + rank;
  Neighbors neighbors = Neighbors(args.neighbors);
  const Instance i =
      fetch_instance(instances, places[neighbors.records[neighbor].entity.x] + record.instance_base);
  const vec3 turned =
      into_frame(i, orientation_of(i, record.t_ns), record.t_ns, query_point_of(instances, record).point);
  const vec3 point = turned / i.scale;

  uint stack[stack_size];
  uint depth = 0u;
  uint rounds = 0u;
  bool cut_short = false;
  int winding = 0;
  uint current = i.closed ? i.blas_root : ref_none;
  while (current != ref_none) {
    rounds += 3u;
    while ((current & ref_leaf_bit) == 0u) {
      ++rounds;
      const WideNode wide = fetch_wide_node(nodes, current);
      [[unroll]] for (uint k = 0u; k < 8u; ++k) {
        const vec3 lo = child_lo(wide, k);
        const vec3 hi = child_hi(wide, k);
        const uint ref = child_reference(wide, k);
        stack[depth] = ref;
        const bool meets = all(lessThanEqual(lo.xy, point.xy)) && all(greaterThanEqual(hi, point));
        depth += meets && ref != ref_none ? 1u : 0u;
      }
      if (depth > stack_limit || rounds > max_rounds) {
        cut_short = true;
        depth = 0u;
      }
      current = ref_none;
      if (depth == 0u) break;
      current = stack[--depth];
    }
    if (current == ref_none) break;
    const uint first = current & ref_triangle_first_mask;
    const uint count = (current >> ref_triangle_count_shift & 0xFu) + 1u;
    for (uint k = 0u; k < count; ++k) {
      ++rounds;
      const int base = int((first + k) * triangle_texels);
      winding +=
          winding_above(texelFetch(triangles, base).xyz - point, texelFetch(triangles, base + 1).xyz - point,
                        texelFetch(triangles, base + 2).xyz - point);
    }
    current = ref_none;
    if (rounds > max_rounds) {
      cut_short = true;
      break;
    }
    if (depth > 0u) current = stack[--depth];
  }
  if (winding != 0) neighbors.records[neighbor].distance_m = -neighbors.records[neighbor].distance_m;
  neighbors.records[neighbor].has_sign = i.closed ? 1u : 0u;
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  if (cut_short) counts[record.place].incomplete = 1u;
}
