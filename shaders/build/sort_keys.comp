#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Prepares a sort by one word of the codes: first by the lower words, while the upper ones are stored aside;
// then by the upper words in the order of the values.
#include "build/sort.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = min((gl_WorkGroupID.x + 1u) * args.run, args.count);
  for (uint i = gl_WorkGroupID.x * args.run + gl_LocalInvocationID.x; i < end; i += 64u) {
    if (args.shift == 0u) words[args.half_size + i] = sorted[i].x;
    sorted[i].x = words[args.shift == 0u ? i : args.half_size + sorted[i].y];
  }
}
