// Stores of two words at once by address. Addresses avoid the size limit of a binding, and lavapipe stores
// lane by lane in a loop per number. Coherent, since the climb of the tree builder loads what other
// invocations of the same dispatch have stored.
#ifndef RTSTDB_COMMON_PAIRS_GLSL
#define RTSTDB_COMMON_PAIRS_GLSL

layout(buffer_reference, buffer_reference_align = 8, scalar) coherent writeonly buffer Pairs {
  uint64_t pairs[];
};

// An iteration of lavapipe's loop extracts one lane of each vector through the stack, which is slow for
// vectors of 64 bytes on some processors (0004). So values that differ between lanes have 32 bits until they
// have been extracted.
struct Destination {
  uint64_t address;  // uniform over the subgroup, and known to be
  uint first_pair;   // below 2^31
};

// The `place`-th element of an array that begins at `first`.
Destination destination_of(uvec2 first, uint place, uint size_bytes) {
  return Destination(subgroupBroadcastFirst(packUint2x32(first)), place * (size_bytes / 8u));
}

void store_pair(Destination to, uint pair, uvec2 words) {
  Pairs(to.address).pairs[to.first_pair + pair] = uint64_t(words.x) + (uint64_t(words.y) << 32);
}

void store_texel(Destination to, uint texel, uvec4 words) {
  store_pair(to, 2u * texel, words.xy);
  store_pair(to, 2u * texel + 1u, words.zw);
}

#endif
