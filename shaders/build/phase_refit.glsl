// The boxes of a TLAS's nodes at both ends of its window, from those of their children, in the slots that the build chose. Nodes
// of a level follow those of the level above, so levels are taken from the deepest up.
//
// Before the include: buffers `wide` (the TLAS's nodes), `motion_boxes` (of the instances) and `node_boxes`.
#ifndef RTSTDB_BUILD_PHASE_REFIT_GLSL
#define RTSTDB_BUILD_PHASE_REFIT_GLSL
#include "build/quantum.glsl"

MotionBox motion_box_of(uint reference) {
  MotionBox box;
  if ((reference & ref_leaf_bit) != 0u) {
    box = motion_boxes[reference & ref_instance_mask];
  } else {
    box = node_boxes[reference];
  }
  return box;
}

struct Edges {
  uvec3 low[2];
  uvec3 high[2];
};

void set_edges(inout Edges edges, uint slot, Box box, Quanta quanta) {
  const uint bit = 8u * (slot & 3u);
  edges.low[slot >> 2] ^= (low_edge(box.lo, quanta) ^ 0xFFu) << bit;
  edges.high[slot >> 2] |= high_edge(box.hi, quanta) << bit;
}

void write_edges(uint base, Edges edges) {
  wide[base] = uvec4(edges.low[0].x, edges.low[1].x, edges.high[0].x, edges.high[1].x);
  wide[base + 1u] = uvec4(edges.low[0].y, edges.low[1].y, edges.high[0].y, edges.high[1].y);
  wide[base + 2u] = uvec4(edges.low[0].z, edges.low[1].z, edges.high[0].z, edges.high[1].z);
}

void refit_node(uint node) {
  const uint base = node * tlas_node_texels;
  const uint used = wide[base].w >> 24;
  const uvec4 references[2] = uvec4[2](wide[base + 4u], wide[base + 5u]);
  MotionBox children[8];
  MotionBox all = MotionBox(Box(vec3(3e38), vec3(-3e38)), Box(vec3(3e38), vec3(-3e38)));
  for (uint slot = 0u; slot < 8u; ++slot) {
    if ((used >> slot & 1u) == 0u) continue;
    children[slot] = motion_box_of(references[slot >> 2][slot & 3u]);
    all = motion_union(all, children[slot]);
  }
  node_boxes[node] = all;
  const Quanta quanta = quanta_of(swept(all));
  // An unused slot is a box turned inside out: no ray enters it.
  Edges begin = Edges(uvec3[2](uvec3(0xFFFFFFFFu), uvec3(0xFFFFFFFFu)), uvec3[2](uvec3(0u), uvec3(0u)));
  Edges end = begin;
  for (uint slot = 0u; slot < 8u; ++slot) {
    if ((used >> slot & 1u) == 0u) continue;
    set_edges(begin, slot, children[slot].begin, quanta);
    set_edges(end, slot, children[slot].end, quanta);
  }
  wide[base] = uvec4(floatBitsToUint(quanta.origin), quanta.exponents | used << 24);
  write_edges(base + 1u, begin);
  write_edges(base + 6u, end);
}

#endif
