// Stores by address, for a binding may end at 128 MiB, and two words at once: lavapipe stores lane by lane, in a loop for each number.
// Coherent: the climb of the tree builder loads in the same dispatch what other invocations have stored.
#ifndef RTSTDB_COMMON_PAIRS_GLSL
#define RTSTDB_COMMON_PAIRS_GLSL

layout(buffer_reference, buffer_reference_align = 8, scalar) coherent writeonly buffer Pairs { uint64_t pairs[]; };

void store_pair(uvec2 address, uint place, uvec2 words) { Pairs(address).pairs[place] = packUint2x32(words); }

void store_texel(uvec2 address, uint place, uvec4 texel) {
  store_pair(address, 2u * place, texel.xy);
  store_pair(address, 2u * place + 1u, texel.zw);
}

#endif
