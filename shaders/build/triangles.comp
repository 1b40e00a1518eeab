#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Triangles in the order of the leaves, three corners each, with their own number.
#include "build/scratch.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { TriangleArgs args; };
layout(set = 0, binding = 11, scalar) readonly buffer PositionsBuffer { vec3 positions[]; };
layout(set = 0, binding = 12, scalar) readonly buffer CornersBuffer { uvec3 corners[]; };
layout(set = 0, binding = 13, scalar) writeonly buffer TrianglesBuffer { vec4 triangles[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.count) return;
  const uint triangle = values[i];
  const uvec3 c = corners[triangle];
  const uint base = (args.leaf_base + i) * triangle_texels;
  triangles[base] = vec4(positions[c.x], uintBitsToFloat(triangle));
  triangles[base + 1u] = vec4(positions[c.y], 0.0);
  triangles[base + 2u] = vec4(positions[c.z], 0.0);
}
