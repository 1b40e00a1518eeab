#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Refit of a deforming geometry, step 1: writes its triangles to the pool with their new corners, in
// unchanged order.
#include "common/has_area.glsl"
#include "shared/blas.h"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BlasRefitArgs args; };
// The corners and the index of each triangle, in leaf order.
layout(set = 0, binding = 0) uniform usamplerBuffer corners;
layout(set = 0, binding = 1) uniform samplerBuffer positions;
layout(set = 0, binding = 2, scalar) writeonly buffer TrianglesBuffer { vec4 triangles[]; };

void main() {
  const uint begin = gl_WorkGroupID.x * blas_tile;
  const uint end = min(begin + blas_tile, args.count);
  for (uint i = begin + gl_LocalInvocationID.x; i < end; i += 64u) {
    const uvec4 triangle = texelFetch(corners, int(i));
    const uint base = i * triangle_texels;
    const vec3 a = texelFetch(positions, int(triangle.x)).xyz;
    const vec3 b = texelFetch(positions, int(triangle.y)).xyz;
    const vec3 c = texelFetch(positions, int(triangle.z)).xyz;
    triangles[base] = vec4(a, uintBitsToFloat(triangle.w));
    triangles[base + 1u] = vec4(b, uintBitsToFloat(has_area(a, b, c) ? 0u : triangle_without_area));
    triangles[base + 2u] = vec4(c, 0.0);
  }
}
