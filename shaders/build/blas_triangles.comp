#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Geometry builder, last: triangles in the order of the leaves, three corners each, with their own number.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint begin = args.first + gl_WorkGroupID.x * blas_tile;
  const uint end = min(begin + blas_tile, args.end);
  for (uint i = begin + gl_LocalInvocationID.x; i < end; i += 64u) {
    const uvec4 triangle = texelFetch(corners, int(values[args.half_size + i]));
    const uint base = (i - args.first) * triangle_texels;
    triangles[base] = vec4(position(triangle.x), uintBitsToFloat(triangle.w));
    triangles[base + 1u] = vec4(position(triangle.y), 0.0);
    triangles[base + 2u] = vec4(position(triangle.z), 0.0);
  }
}
