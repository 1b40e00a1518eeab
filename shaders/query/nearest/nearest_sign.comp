#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The sign of each neighbor's distance: whether the entity's closed surface winds around the point, which
// does not depend on the entity's scale.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "query/nearest/point.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { NearestArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2, scalar) readonly buffer PointsBuffer { NearestRecord points[]; };
layout(set = 0, binding = 3, scalar) buffer CountsBuffer { NearestCount counts[]; };
layout(set = 0, binding = 4) uniform samplerBuffer triangles;
layout(set = 0, binding = 5, scalar) readonly buffer PlacesBuffer { uint places[]; };
#include "query/nearest/winding.glsl"

layout(buffer_reference, buffer_reference_align = 8, scalar) buffer Neighbors { NeighborRecord records[]; };

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

  const Winding around = winding_around(i.closed ? i.blas_root : ref_none, point);
  if (around.number != 0) neighbors.records[neighbor].distance_m = -neighbors.records[neighbor].distance_m;
  neighbors.records[neighbor].has_sign = i.closed ? 1u : 0u;
  const bool cut_short = around.cut_short || !loops_still_turn(args.loop_probe);
  if (cut_short) counts[record.place].incomplete = 1u;
}
