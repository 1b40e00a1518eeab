#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Primitives of a BLAS: the boxes of its triangles.
#include "build/scratch.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { TriangleArgs args; };
layout(set = 0, binding = 11, scalar) readonly buffer PositionsBuffer { vec3 positions[]; };
layout(set = 0, binding = 12, scalar) readonly buffer CornersBuffer { uvec3 corners[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.count) return;
  const uvec3 c = corners[i];
  const vec3 a = positions[c.x];
  bounds[i] = Box(min(a, min(positions[c.y], positions[c.z])), max(a, max(positions[c.y], positions[c.z])));
}
