// Stores by address, for a binding may end at 128 MiB, and two words at once: lavapipe stores lane by lane, in a loop for each number.
// Coherent: the climb of the tree builder loads in the same dispatch what other invocations have stored.
#ifndef RTSTDB_COMMON_PAIRS_GLSL
#define RTSTDB_COMMON_PAIRS_GLSL

layout(buffer_reference, buffer_reference_align = 8, scalar) coherent writeonly buffer Pairs {
  uint64_t pairs[];
};

// A round of lavapipe's loop takes one lane's part out of each vector that it needs, by way of the stack, and some processors are slow
// to do so with vectors of 64 bytes (0004). So what differs from lane to lane has 32 bits until it has been taken out.
struct Destination {
  uint64_t address;  // the same for all lanes, and known to be
  uint first_pair;   // below 2^31
};

// Of the `place`-th in a row of things that begins at `first`.
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
