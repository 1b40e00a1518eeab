#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// After the sort by the upper word: values whose upper words are the same, by the lower one. Whoever finds the first of them puts
// them in order, if they are few; whether any others are in disorder is for the next pass to find.
#include "build/sort.glsl"

layout(local_size_x = 64) in;

const uint most_ties = 32u;

uint low_word(uint value) { return keys[2u * args.half_size + value]; }

void main() {
  const uint end = min((gl_WorkGroupID.x + 1u) * args.run, args.count);
  for (uint i = gl_WorkGroupID.x * args.run + gl_LocalInvocationID.x; i < end; i += 64u) {
    const uint key = keys[i];
    const bool first = i == 0u || keys[max(i, 1u) - 1u] != key;
    const uint limit = first ? min(i + most_ties, args.count) : i;
    uint last = i + 1u;
    while (last < limit && keys[last] == key) ++last;
    // Of a longer row nobody is moved.
    const bool whole = first && (last == args.count || keys[min(last, args.count - 1u)] != key);
    for (uint next = i + 1u; whole && next < last; ++next) {
      const uint value = values[next];
      const uint low = low_word(value);
      uint to = next;
      while (to > i && low_word(values[max(to, 1u) - 1u]) > low) {
        values[to] = values[to - 1u];
        --to;
      }
      values[to] = value;
    }
  }
}
