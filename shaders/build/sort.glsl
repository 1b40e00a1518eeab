// The radix sort of all builders, by one word of the codes, least digit first, stable: every invocation owns a run of
// consecutive keys and counts in memory of its own, so that nothing depends on the size of a subgroup and nobody waits.
//
// The upper word says it nearly all: its few ties are put in order by the lower word afterwards (sort_ties.comp). Where many
// codes share the upper word, the lower word is sorted by first (sort_keys.comp).
#ifndef RTSTDB_BUILD_SORT_GLSL
#define RTSTDB_BUILD_SORT_GLSL
#include "shared/build.h"

// Keys in four parts of half_size words: two taken in turns with the halves of the values, the upper words first; then the lower
// words in the order that the values number them by, and room for the upper ones.
layout(set = 0, binding = 0, scalar) buffer KeysBuffer { uint keys[]; };
layout(set = 0, binding = 1, scalar) buffer ValuesBuffer { uint values[]; };
// Row r of the counts is that of run r, 256 digits; the row behind the last holds where each digit begins.
layout(set = 0, binding = 2, scalar) buffer OffsetsBuffer { uvec4 counts[]; };

layout(push_constant, scalar) uniform Push { SortArgs args; };

const uint row_fours = radix_digits / 4u;

uint run_count() { return (args.count + args.run - 1u) / args.run; }
uint source_half() { return args.source * args.half_size; }
uint digit_of(uint key) { return key >> args.shift & (radix_digits - 1u); }

#endif
