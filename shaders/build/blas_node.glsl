// Encodes one wide node in the format that queries read (shaders/shared/node.h).
#ifndef RTSTDB_BUILD_BLAS_NODE_GLSL
#define RTSTDB_BUILD_BLAS_NODE_GLSL
#include "build/tree_scratch.glsl"
#include "build/quantum.glsl"
#include "build/slots.glsl"

// All loops over children and slots have constant trip counts, so that the compiler keeps arrays in
// registers.
struct WideNode {
  Box box[8];
  uint reference[8];
  uint count;  // boxes at this index and above duplicate earlier ones
};

void write_wide_node(uint index, WideNode node) {
  Box all = node.box[0];
  [[unroll]] for (uint k = 1u; k < 8u; ++k) all = box_union(all, node.box[k]);
  vec3 away[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) away[k] = center_of(node.box[k]) - center_of(all);
  const uint slots = choose_slots(away, node.count);
  const Quanta quanta = quanta_of(all);
  // An unused slot holds an inverted box, which no ray enters.
  uvec3 low_edges[2] = uvec3[2](uvec3(0xFFFFFFFFu), uvec3(0xFFFFFFFFu));
  uvec3 high_edges[2] = uvec3[2](uvec3(0u), uvec3(0u));
  uint references[8] =
      uint[8](ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none);
  uint used = 0u;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint slot = k < node.count ? slots >> 3u * k & 7u : 8u;
    const uint bit = 8u * (slot & 3u);
    const uvec3 lo = low_edge(node.box[k].lo, quanta) ^ 0xFFu;
    const uvec3 hi = high_edge(node.box[k].hi, quanta);
    [[unroll]] for (uint word = 0u; word < 2u; ++word) {
      low_edges[word] ^= slot >> 2 == word ? lo << bit : uvec3(0u);
      high_edges[word] |= slot >> 2 == word ? hi << bit : uvec3(0u);
    }
    [[unroll]] for (uint other = 0u; other < 8u; ++other) {
      references[other] = slot == other ? node.reference[k] : references[other];
    }
    used |= slot < 8u ? 1u << slot : 0u;
  }
  const Destination to = destination_of(args.target, index, 16u * node_texels);
  store_texel(to, 0u, uvec4(floatBitsToUint(quanta.origin), quanta.exponents | used << 24));
  store_texel(to, 1u, uvec4(low_edges[0].x, low_edges[1].x, high_edges[0].x, high_edges[1].x));
  store_texel(to, 2u, uvec4(low_edges[0].y, low_edges[1].y, high_edges[0].y, high_edges[1].y));
  store_texel(to, 3u, uvec4(low_edges[0].z, low_edges[1].z, high_edges[0].z, high_edges[1].z));
  store_texel(to, 4u, uvec4(references[0], references[1], references[2], references[3]));
  store_texel(to, 5u, uvec4(references[4], references[5], references[6], references[7]));
}

#endif
