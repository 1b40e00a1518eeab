#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// After the sort by the upper words: sorts values with equal upper words by their lower words. The invocation
// at the first of them sorts a short row; the next pass detects what is still unsorted.
#include "build/sort.glsl"

layout(local_size_x = 64) in;

const uint max_ties = 32u;

uint key_at(uint place) { return sorted[place].x; }
uint low_word_at(uint place) { return words[sorted[place].y]; }

void main() {
  const uint end = min((gl_WorkGroupID.x + 1u) * args.run, args.count);
  for (uint i = gl_WorkGroupID.x * args.run + gl_LocalInvocationID.x; i < end; i += 64u) {
    const uint key = key_at(i);
    const bool first = i == 0u || key_at(max(i, 1u) - 1u) != key;
    const uint limit = first ? min(i + max_ties, args.count) : i;
    uint last = i + 1u;
    while (last < limit && key_at(last) == key) ++last;
    // Leaves longer rows as they are.
    const bool whole = first && (last == args.count || key_at(min(last, args.count - 1u)) != key);
    for (uint next = i + 1u; whole && next < last; ++next) {
      const uint value = sorted[next].y;
      const uint low = words[value];
      uint to = next;
      while (to > i && low_word_at(max(to, 1u) - 1u) > low) {
        sorted[to].y = sorted[to - 1u].y;
        --to;
      }
      sorted[to].y = value;
    }
  }
}
