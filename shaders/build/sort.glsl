// The stable radix sort of all builders. It sorts by one word of the codes, least significant digit first.
// Each invocation owns a run of consecutive keys and counts in private memory, so the result does not depend
// on the subgroup size and no invocation waits.
//
// The upper word of the codes nearly determines the order; sort_ties.comp afterwards orders the few codes
// with equal upper words by their lower words. If many codes share an upper word, sort_keys.comp first sorts
// by the lower word.
#ifndef RTSTDB_BUILD_SORT_GLSL
#define RTSTDB_BUILD_SORT_GLSL
#include "common/pairs.glsl"
#include "shared/build.h"

// Buffers: keys with their values, in two halves of half_size that alternate as source and destination; the
// lower words of the codes in the order of the values, followed by space for as many upper ones; and counts,
// where row r holds the 256 digit counts of run r, and one more row holds where each digit begins.
//
// With SORT_BY_TEXELS defined, a pass loads keys and counts as whole texels and stores two words at once by
// address (common/pairs.glsl). Such a pass must not load what it stores.
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
// The keys and values at two positions of the source, the first of which is even.
uvec4 two_at(uint place) { return imageLoad(sorted, int(args.source * args.half_size + place >> 1)); }
#endif
uint digit_of(uint key) { return key >> args.shift & (radix_digits - 1u); }

#endif
