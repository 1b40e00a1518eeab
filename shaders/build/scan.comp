#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Exclusive prefix sum over `scan_count` words of offsets by one workgroup; the sum goes to state[state_level_count].
// Reduce, scan, add: nobody waits for another workgroup.
#include "build/scratch.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

shared uint sums[64];

void main() {
  const uint lane = gl_LocalInvocationID.x;
  const uint run = (args.scan_count + 63u) / 64u;
  const uint first = lane * run;
  const uint end = min(first + run, args.scan_count);
  uint sum = 0u;
  for (uint i = first; i < end; ++i) sum += offsets[i];
  sums[lane] = sum;
  barrier();
  if (lane == 0u) {
    uint total = 0u;
    for (uint k = 0u; k < 64u; ++k) {
      const uint here = sums[k];
      sums[k] = total;
      total += here;
    }
    state[state_level_count] = total;
  }
  barrier();
  uint running = sums[lane];
  for (uint i = first; i < end; ++i) {
    const uint here = offsets[i];
    offsets[i] = running;
    running += here;
  }
}
