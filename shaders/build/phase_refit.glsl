// Computes the boxes of a TLAS's nodes at both ends of its window from those of their children, in the slots
// that the build chose. The nodes of a level follow those of the level above, so levels are processed from
// the deepest up.
//
// Before the include, define the buffers `wide` (the TLAS's nodes) and `motion_boxes` (of the instances,
// followed from args.node_boxes on by those of the nodes). If the dispatch writes nothing that it reads, also
// define BOX_AT(place) and NODE_TEXEL(place), which read both as texels.
#ifndef RTSTDB_BUILD_PHASE_REFIT_GLSL
#define RTSTDB_BUILD_PHASE_REFIT_GLSL
#include "build/quantum.glsl"

#ifndef BOX_AT
#define BOX_AT(place) motion_boxes[place]
#define NODE_TEXEL(place) wide[place]
#endif

// One array holds both, since on lavapipe a conditional load from two arrays would load both.
uint box_place(uint reference) {
  return (reference & ref_leaf_bit) != 0u ? reference & ref_instance_mask : args.node_boxes + reference;
}

struct Edges {
  uvec3 low[2];
  uvec3 high[2];
};

void set_edges(inout Edges edges, uint slot, bool used, Box box, Quanta quanta) {
  const uint bit = 8u * (slot & 3u);
  edges.low[slot >> 2] ^= used ? (low_edge(box.lo, quanta) ^ 0xFFu) << bit : uvec3(0u);
  edges.high[slot >> 2] |= used ? high_edge(box.hi, quanta) << bit : uvec3(0u);
}

void write_edges(uint base, Edges edges) {
  wide[base] = uvec4(edges.low[0].x, edges.low[1].x, edges.high[0].x, edges.high[1].x);
  wide[base + 1u] = uvec4(edges.low[0].y, edges.low[1].y, edges.high[0].y, edges.high[1].y);
  wide[base + 2u] = uvec4(edges.low[0].z, edges.low[1].z, edges.high[0].z, edges.high[1].z);
}

// Loops have constant trip counts, so that the compiler keeps arrays in registers.
void refit_node(uint node) {
  const uint base = node * tlas_node_texels;
  const uint used = NODE_TEXEL(base).w >> 24;
  const uvec4 references[2] = uvec4[2](NODE_TEXEL(base + 4u), NODE_TEXEL(base + 5u));
  // A slot without a child repeats another child, which changes no box. ref_none is the largest reference.
  const uvec4 lower = min(references[0], references[1]);
  const uint some = min(min(lower.x, lower.y), min(lower.z, lower.w));
  MotionBox children[8];
  [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) {
    const uint reference = references[slot >> 2][slot & 3u];
    children[slot] = BOX_AT(box_place(reference != ref_none ? reference : some));
  }
  MotionBox all = children[0];
  [[unroll]] for (uint slot = 1u; slot < 8u; ++slot) all = motion_union(all, children[slot]);
  motion_boxes[args.node_boxes + node] = all;
  const Quanta quanta = quanta_of(swept(all));
  // An unused slot holds an inverted box, which no ray enters.
  Edges begin = Edges(uvec3[2](uvec3(0xFFFFFFFFu), uvec3(0xFFFFFFFFu)), uvec3[2](uvec3(0u), uvec3(0u)));
  Edges end = begin;
  uint leaves = 0u;
  [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) {
    const bool is_used = (used >> slot & 1u) != 0u;
    set_edges(begin, slot, is_used, children[slot].begin, quanta);
    set_edges(end, slot, is_used, children[slot].end, quanta);
    leaves |= references[slot >> 2][slot & 3u] >> 31 << slot;
  }
  wide[base] = uvec4(floatBitsToUint(quanta.origin), quanta.exponents | used << 24);
  write_edges(base + 1u, begin);
  write_edges(base + 6u, end);
  wide[base + 9u] = uvec4(floatBitsToUint(all.overhang), leaves & used);
}

#endif
