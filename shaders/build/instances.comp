#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Primitives of a TLAS: one instance with its motion bounds per live entity. Large scenes; small ones: tlas_small.comp.
#include "build/phase_instances.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { InstanceArgs args; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.count) return;
  const Instance instance = write_instance(i, args.window_begin);
  if (i < args.visible_count) bounds[i] = bounds_of(instance, args.window_s);
}
