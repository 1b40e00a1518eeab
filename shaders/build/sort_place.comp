#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Radix sort, step 3 of 3: moves keys and values to their positions.
#define SORT_BY_TEXELS
#include "build/sort.glsl"

layout(local_size_x = 32) in;

void main() {
  const uint run = gl_GlobalInvocationID.x;
  const uint runs = run_count();
  if (run >= runs) return;
  const uint target_half = (1u - args.source) * args.half_size;
  uint place[radix_digits];
  for (uint k = 0u; k < row_fours; ++k) {
    const uvec4 begin = counts_at(runs, k) + counts_at(run, k) + target_half;
    place[4u * k] = begin.x;
    place[4u * k + 1u] = begin.y;
    place[4u * k + 2u] = begin.z;
    place[4u * k + 3u] = begin.w;
  }
  const Destination to = destination_of(args.sorted, 0u, 8u);
  const uint end = min((run + 1u) * args.run, args.count);
  for (uint i = run * args.run; i < end; i += 2u) {
    const uvec4 two = two_at(i);
    store_pair(to, place[digit_of(two.x)]++, two.xy);
    if (i + 1u < end) store_pair(to, place[digit_of(two.z)]++, two.zw);
  }
}
