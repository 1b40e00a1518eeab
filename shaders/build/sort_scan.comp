#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Radix sort, step 2 of 3, one workgroup: turns counts into positions, by prefix sums over the runs of each
// digit and then over the digits.
#include "build/sort.glsl"

layout(local_size_x = 64) in;

shared uint sums[row_fours];

void main() {
  const uint four = gl_LocalInvocationID.x;
  const uint runs = run_count();
  uvec4 before = uvec4(0u);
  for (uint run = 0u; run < runs; ++run) {
    const uvec4 here = counts[run * row_fours + four];
    counts[run * row_fours + four] = before;
    before += here;
  }
  sums[four] = before.x + before.y + before.z + before.w;
  barrier();
  uint begin = 0u;
  for (uint k = 0u; k < four; ++k) begin += sums[k];
  counts[runs * row_fours + four] =
      uvec4(begin, begin + before.x, begin + before.x + before.y, begin + before.x + before.y + before.z);
}
