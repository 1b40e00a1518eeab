#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Primitives of a TLAS: the motion bounds of every live entity, and its instances. Large scenes; small ones: tlas_small.comp.
#include "build/phase_instances.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { InstanceArgs args; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.count) return;
  const Box box = write_instances(i, args);
  if (i >= args.visible_count) return;
  bounds[i].lo = box.lo;
  bounds[i].hi = box.hi;
}
