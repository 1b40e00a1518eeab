#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Radix sort, 1 of 3: how often each digit occurs in each run.
#include "build/sort.glsl"

layout(local_size_x = 32) in;

void main() {
  const uint run = gl_GlobalInvocationID.x;
  if (run >= run_count()) return;
  uint count[radix_digits];
  for (uint digit = 0u; digit < radix_digits; ++digit) count[digit] = 0u;
  const uint half_begin = source_half();
  const uint end = min((run + 1u) * args.run, args.count);
  for (uint i = run * args.run; i < end; ++i) ++count[digit_of(keys[half_begin + i])];
  for (uint k = 0u; k < row_fours; ++k) {
    counts[run * row_fours + k] = uvec4(count[4u * k], count[4u * k + 1u], count[4u * k + 2u], count[4u * k + 3u]);
  }
}
