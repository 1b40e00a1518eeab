// Stores by address, for a binding may end at 128 MiB, and two words at once: lavapipe stores lane by lane, in a loop for each number.
// Coherent: the climb of the tree builder loads in the same dispatch what other invocations have stored.
#ifndef RTSTDB_COMMON_PAIRS_GLSL
#define RTSTDB_COMMON_PAIRS_GLSL

layout(buffer_reference, buffer_reference_align = 8, scalar) coherent writeonly buffer Pairs { uint64_t pairs[]; };

// Of the `place`-th in a row of things, for all that is stored of it: lavapipe's loops carry along what an address is made of, and an
// address that is there takes a fifth off them.
uvec2 address_of(uvec2 first, uint place, uint size_bytes) {
  return unpackUint2x32(packUint2x32(first) + uint64_t(place) * uint64_t(size_bytes));
}

void store_pair(uvec2 address, uint place, uvec2 words) { Pairs(address).pairs[place] = packUint2x32(words); }

void store_texel(uvec2 address, uint place, uvec4 texel) {
  store_pair(address, 2u * place, texel.xy);
  store_pair(address, 2u * place + 1u, texel.zw);
}

#endif
