#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The sign of the distances to a closed geometry by winding number: inside, distance and gradient are
// negated. Runs after field_distances.comp.
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/field.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { FieldArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2, scalar) readonly buffer PointsBuffer { FieldPoint points[]; };
layout(set = 0, binding = 3, scalar) buffer SamplesBuffer { FieldSample samples[]; };
#include "query/nearest/winding.glsl"

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  const Winding around = winding_around(args.root, points[index].point_m);
  const FieldSample found = samples[index];
  // On the surface the gradient is the outer normal already.
  const bool is_inside = around.number != 0 && found.distance_m > 0.0;
  const bool cut_short = around.cut_short || !loops_still_turn(args.loop_probe);
  samples[index] = FieldSample(cut_short   ? vec3(0.0)
                               : is_inside ? -found.gradient
                                           : found.gradient,
                               is_inside ? -found.distance_m : found.distance_m);
}
