#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Before a sort by each of the words of the codes: first the lower word, and the upper one is put away; then the upper word in the
// order in which the values have come to stand.
#include "build/sort.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = min((gl_WorkGroupID.x + 1u) * args.run, args.count);
  for (uint i = gl_WorkGroupID.x * args.run + gl_LocalInvocationID.x; i < end; i += 64u) {
    if (args.shift == 0u) words[args.half_size + i] = sorted[i].x;
    sorted[i].x = words[args.shift == 0u ? i : args.half_size + sorted[i].y];
  }
}
