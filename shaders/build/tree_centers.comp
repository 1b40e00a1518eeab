#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, step 1: the box around the centres of all primitives, which defines the Morton grid. Reduces
// within the workgroup, then by atomics on ordered integers.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

shared vec3 lo[64];
shared vec3 hi[64];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  vec3 low = vec3(3e38);
  vec3 high = vec3(-3e38);
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u) {
    const vec3 center = center_of(box_of_primitive(i));
    low = min(low, center);
    high = max(high, center);
  }
  lo[lane] = low;
  hi[lane] = high;
  for (uint step = 32u; step >= 1u; step /= 2u) {
    barrier();
    if (lane < step) {
      lo[lane] = min(lo[lane], lo[lane + step]);
      hi[lane] = max(hi[lane], hi[lane + step]);
    }
  }
  barrier();
  if (lane < 3u) {
    atomicMax(state[blas_center_min + lane], ~ordered(lo[0][lane]));
    atomicMax(state[blas_center_max + lane], ordered(hi[0][lane]));
  }
}
