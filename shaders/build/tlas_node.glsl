// Writes slots and references of a TLAS node; the refit (phase_refit.glsl) computes its boxes.
//
// Before the include, define the buffer `wide`.
#ifndef RTSTDB_BUILD_TLAS_NODE_GLSL
#define RTSTDB_BUILD_TLAS_NODE_GLSL
#include "build/slots.glsl"
#include "common/bounds.glsl"
#include "shared/node.h"

// Loops have constant trip counts, so that the compiler keeps arrays in registers. Children from `count` on
// are not used.
void write_tlas_node(uint index, Box box[8], uint reference[8], uint count) {
  Box all = box[0];
  [[unroll]] for (uint k = 1u; k < 8u; ++k) {
    all.lo = k < count ? min(all.lo, box[k].lo) : all.lo;
    all.hi = k < count ? max(all.hi, box[k].hi) : all.hi;
  }
  vec3 away[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) away[k] = center_of(box[k]) - center_of(all);
  const uint slots = choose_slots(away, count);
  uint references[8] =
      uint[8](ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none, ref_none);
  uint used = 0u;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint slot = k < count ? slots >> 3u * k & 7u : 8u;
    [[unroll]] for (uint other = 0u; other < 8u; ++other) references[other] =
        slot == other ? reference[k] : references[other];
    used |= slot < 8u ? 1u << slot : 0u;
  }
  const uint base = index * tlas_node_texels;
  wide[base] = uvec4(0u, 0u, 0u, used << 24);
  wide[base + 4u] = uvec4(references[0], references[1], references[2], references[3]);
  wide[base + 5u] = uvec4(references[4], references[5], references[6], references[7]);
}

#endif
