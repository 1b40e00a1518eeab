#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Before a sort by each of the words of the codes: first the lower word, and the upper one is put away; then the upper word in the
// order in which the values have come to stand.
#include "build/sort.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint low_begin = 2u * args.half_size;
  const uint high_begin = 3u * args.half_size;
  const uint end = min((gl_WorkGroupID.x + 1u) * args.run, args.count);
  for (uint i = gl_WorkGroupID.x * args.run + gl_LocalInvocationID.x; i < end; i += 64u) {
    if (args.shift == 0u) keys[high_begin + i] = keys[i];
    keys[i] = keys[args.shift == 0u ? low_begin + i : high_begin + values[i]];
  }
}
