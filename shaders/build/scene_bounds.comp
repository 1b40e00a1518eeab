#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The box of all primitives' centres, for the Morton grid: reduced in the workgroup, then by ordered atomics.
#include "build/phase_morton.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

shared vec3 lo[64];
shared vec3 hi[64];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint i = gl_GlobalInvocationID.x;
  lo[lane] = vec3(3e38);
  hi[lane] = vec3(-3e38);
  if (i < args.count) lo[lane] = hi[lane] = center_of(bounds[i]);
  for (uint step = 32u; step >= 1u; step /= 2u) {
    barrier();
    if (lane < step) {
      lo[lane] = min(lo[lane], lo[lane + step]);
      hi[lane] = max(hi[lane], hi[lane + step]);
    }
  }
  barrier();
  if (lane < 3u) {
    atomicMin(state[state_center_min + lane], ordered(lo[0][lane]));
    atomicMax(state[state_center_max + lane], ordered(hi[0][lane]));
  }
}
