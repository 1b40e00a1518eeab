// The radix sort of all builders, by one word of the codes, least digit first, stable: every invocation owns a run of
// consecutive keys and counts in memory of its own, so that nothing depends on the size of a subgroup and nobody waits.
//
// The upper word says it nearly all: its few ties are put in order by the lower word afterwards (sort_ties.comp). Where many
// codes share the upper word, the lower word is sorted by first (sort_keys.comp).
#ifndef RTSTDB_BUILD_SORT_GLSL
#define RTSTDB_BUILD_SORT_GLSL
#include "common/pairs.glsl"
#include "shared/build.h"

// Keys with their values, in two halves of half_size that are taken in turns; the lower words of the codes in the order that the
// values number them by, and room for as many upper ones; and counts: row r is that of run r, 256 digits, the row behind the last
// holds where each digit begins.
//
// Where SORT_BY_TEXELS is defined, keys and counts are loaded as whole texels, and stored by address, two words at once
// (common/pairs.glsl): for passes that load nothing that they store.
#ifdef SORT_BY_TEXELS
layout(set = 0, binding = 0, rgba32ui) readonly uniform uimageBuffer sorted;
layout(set = 0, binding = 2, rgba32ui) readonly uniform uimageBuffer counts;
#else
layout(set = 0, binding = 0, scalar) buffer SortedBuffer { uvec2 sorted[]; };
layout(set = 0, binding = 2, scalar) buffer CountsBuffer { uvec4 counts[]; };
#endif
layout(set = 0, binding = 1, scalar) buffer WordsBuffer { uint words[]; };

layout(push_constant, scalar) uniform Push { SortArgs args; };

const uint row_fours = radix_digits / 4u;

uint run_count() { return (args.count + args.run - 1u) / args.run; }
#ifdef SORT_BY_TEXELS
uvec4 counts_at(uint row, uint four) { return imageLoad(counts, int(row * row_fours + four)); }
// The keys and values at two places of the source, of which the first is even.
uvec4 two_at(uint place) { return imageLoad(sorted, int(args.source * args.half_size + place >> 1)); }
#endif
uint digit_of(uint key) { return key >> args.shift & (radix_digits - 1u); }

#endif
