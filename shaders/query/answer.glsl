// Answers go to the host's memory by address, for a binding may end at 128 MiB, and two words at once: lavapipe stores lane by lane, in
// a loop for each number.
#ifndef RTSTDB_QUERY_ANSWER_GLSL
#define RTSTDB_QUERY_ANSWER_GLSL

layout(buffer_reference, buffer_reference_align = 8, scalar) writeonly buffer Pairs { uint64_t pairs[]; };

void store_pair(uvec2 address, uint place, uvec2 words) { Pairs(address).pairs[place] = packUint2x32(words); }

#endif
