#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Geometry builder, for a geometry that deforms: which corners each triangle has in the order of the leaves, and its own number.
// They go where wide nodes do, on their way to a buffer of the geometry's own.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint begin = args.first + gl_WorkGroupID.x * blas_tile;
  const uint end = min(begin + blas_tile, args.end);
  for (uint i = begin + gl_LocalInvocationID.x; i < end; i += 64u) {
    wide[i - args.first] = texelFetch(corners, int(values[args.half_size + i]));
  }
}
