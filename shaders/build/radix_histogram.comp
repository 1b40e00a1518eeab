#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Radix sort, 1 of 3: how often each digit occurs in each tile. Bin-major, so that one scan gives every tile its place.
#include "build/scratch.glsl"

layout(local_size_x = 32) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

shared uint bins[radix_bins];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  for (uint b = lane; b < radix_bins; b += radix_group) bins[b] = 0u;
  barrier();
  const uint first = gl_WorkGroupID.x * radix_tile + lane * radix_run;
  for (uint k = 0u; k < radix_run; ++k) {
    const uint i = first + k;
    if (i >= args.count) break;
    const uint64_t key = packUint2x32(keys[args.source * args.half_size + i]);
    atomicAdd(bins[uint(key >> args.shift) & (radix_bins - 1u)], 1u);
  }
  barrier();
  for (uint b = lane; b < radix_bins; b += radix_group) offsets[b * gl_NumWorkGroups.x + gl_WorkGroupID.x] = bins[b];
}
