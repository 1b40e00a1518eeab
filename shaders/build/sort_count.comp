#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Radix sort, step 1 of 3: counts each digit in each run.
#define SORT_BY_TEXELS
#include "build/sort.glsl"

layout(local_size_x = 32) in;

void main() {
  const uint run = gl_GlobalInvocationID.x;
  if (run >= run_count()) return;
  uint count[radix_digits];
  for (uint digit = 0u; digit < radix_digits; ++digit) count[digit] = 0u;
  const uint end = min((run + 1u) * args.run, args.count);
  for (uint i = run * args.run; i < end; i += 2u) {
    const uvec4 two = two_at(i);
    ++count[digit_of(two.x)];
    if (i + 1u < end) ++count[digit_of(two.z)];
  }
  const Destination to = destination_of(args.counts, run, 16u * row_fours);
  for (uint k = 0u; k < row_fours; ++k) {
    store_texel(to, k, uvec4(count[4u * k], count[4u * k + 1u], count[4u * k + 2u], count[4u * k + 3u]));
  }
}
