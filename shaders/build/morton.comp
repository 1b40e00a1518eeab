#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Morton codes, and clean arrival counts for the fit.
#include "build/phase_morton.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.count) return;
  vec3 lo;
  vec3 hi;
  for (uint axis = 0u; axis < 3u; ++axis) {
    lo[axis] = unordered(state[state_center_min + axis]);
    hi[axis] = unordered(state[state_center_max + axis]);
  }
  keys[i] = morton_code(center_of(bounds[i]), lo, hi);
  values[i] = i;
  arrivals[i] = 0u;
}
