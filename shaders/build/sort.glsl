// The radix sort of all builders, least digit first, stable: every invocation owns a run of consecutive keys and counts in
// memory of its own, so that nothing depends on the size of a subgroup and nobody waits.
#ifndef RTSTDB_BUILD_SORT_GLSL
#define RTSTDB_BUILD_SORT_GLSL
#include "shared/build.h"

// Keys and values in two halves, taken in turns. Row r of the counts is that of run r, 256 digits; the row behind
// the last holds where each digit begins.
layout(set = 0, binding = 0, scalar) buffer KeysBuffer { uvec2 keys[]; };
layout(set = 0, binding = 1, scalar) buffer ValuesBuffer { uint values[]; };
layout(set = 0, binding = 2, scalar) buffer OffsetsBuffer { uvec4 counts[]; };

layout(push_constant, scalar) uniform Push { SortArgs args; };

const uint row_fours = radix_digits / 4u;

uint run_count() { return (args.count + args.run - 1u) / args.run; }
uint source_half() { return args.source * args.half_size; }
uint digit_of(uint place) {
  const uint word = keys[place][args.shift >> 5];
  return word >> (args.shift & 31u) & (radix_digits - 1u);
}

#endif
