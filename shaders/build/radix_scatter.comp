#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Radix sort, 3 of 3: keys and values to their places, stable. Each invocation owns a run of consecutive keys; counts of a
// digit in the runs before it give its keys their rank, whatever the subgroup size.
#include "build/scratch.glsl"

layout(local_size_x = 32) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

// Counts of two invocations in one word: a run has at most 64 keys, a tile 2048, so 16 bits hold every sum.
shared uint ranks[radix_bins * (radix_group / 2)];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint word = lane / 2u;
  const uint bit = (lane & 1u) * 16u;
  for (uint k = lane; k < radix_bins * (radix_group / 2u); k += radix_group) ranks[k] = 0u;
  barrier();
  const uint source = args.source * args.half_size;
  const uint target = (1u - args.source) * args.half_size;
  const uint first = gl_WorkGroupID.x * radix_tile + lane * radix_run;
  const uint end = min(first + radix_run, args.count);
  for (uint i = first; i < end; ++i) {
    const uint digit = uint(packUint2x32(keys[source + i]) >> args.shift) & (radix_bins - 1u);
    atomicAdd(ranks[digit * (radix_group / 2u) + word], 1u << bit);
  }
  barrier();
  // Exclusive sums over the invocations, per digit.
  for (uint digit = lane; digit < radix_bins; digit += radix_group) {
    uint running = 0u;
    for (uint k = 0u; k < radix_group / 2u; ++k) {
      const uint both = ranks[digit * (radix_group / 2u) + k];
      const uint low = both & 0xFFFFu;
      ranks[digit * (radix_group / 2u) + k] = running | (running + low) << 16;
      running += low + (both >> 16);
    }
  }
  barrier();
  for (uint i = first; i < end; ++i) {
    const uvec2 key = keys[source + i];
    const uint digit = uint(packUint2x32(key) >> args.shift) & (radix_bins - 1u);
    const uint before = atomicAdd(ranks[digit * (radix_group / 2u) + word], 1u << bit);
    const uint place = offsets[digit * gl_NumWorkGroups.x + gl_WorkGroupID.x] + (before >> bit & 0xFFFFu);
    keys[target + place] = key;
    values[target + place] = values[source + i];
  }
}
