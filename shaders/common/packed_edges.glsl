// Compares the box edges of a node's children with planes perpendicular to the axes, four children at once.
// An edge is one byte, and so is a plane rounded to whole quanta.
#ifndef RTSTDB_COMMON_PACKED_EDGES_GLSL
#define RTSTDB_COMMON_PACKED_EDGES_GLSL
#include "shared/node.h"

// Define REGION_BOUNDS before the include to search by the entities' oriented bounds.

// The children's boxes at an instant in quanta from the origin, low edges in xy and high ones in zw. For
// windows longer than an instant mixed_edges() computes them.
struct PackedNode {
  vec3 origin;
  vec3 per_quantum;
  uint used;  // one bit per child
  uvec4 edges[3];
  float below;    // quanta by which mixing may have lowered an edge
  float above;    // and raised it
  vec3 overhang;  // of oriented bounds beyond the children's boxes, in the unit of the origin
#ifdef REGION_BOUNDS
  uint leaves;  // one bit per child that is an entity
#endif
};

// The mix of begin and end at `share` in 256ths, rounded down. Its error before rounding is at most half a
// quantum.
uvec4 mixed_edges(uvec4 begin, uvec4 end, uint share) {
  const uint even = 0x00FF00FFu;
  const uint rest = 256u - share;
  const uvec4 low = (begin & even) * rest + (end & even) * share;
  const uvec4 high = (begin >> 8u & even) * rest + (end >> 8u & even) * share;
  return (low >> 8u & even) | (high & ~even);
}

PackedNode packed_node_of(uvec4 head, uvec4 x, uvec4 y, uvec4 z) {
  PackedNode packed;
  packed.origin = uintBitsToFloat(head.xyz);
  // The inverse of a power of two.
  packed.per_quantum = vec3(uintBitsToFloat(254u - (head.w & 0xFFu) << 23),
                            uintBitsToFloat(254u - (head.w >> 8 & 0xFFu) << 23),
                            uintBitsToFloat(254u - (head.w >> 16 & 0xFFu) << 23));
  packed.used = head.w >> 24;
  packed.edges = uvec4[](x, y, z);
  packed.below = packed.above = 0.0;
  packed.overhang = vec3(0.0);
  return packed;
}

PackedNode fetch_packed_node(usamplerBuffer tlas, uint node, uint share) {
  const int base = int(node * tlas_node_texels);
  PackedNode packed = packed_node_of(texelFetch(tlas, base), texelFetch(tlas, base + 1),
                                     texelFetch(tlas, base + 2), texelFetch(tlas, base + 3));
#ifdef REGION_MOVING
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
    packed.edges[axis] = mixed_edges(packed.edges[axis], texelFetch(tlas, base + 6 + axis), share);
  }
  packed.below = 1.5;
  packed.above = 0.5;
#endif
#ifdef REGION_BOUNDS
  const uvec4 tail = texelFetch(tlas, base + 9);
  packed.overhang = uintBitsToFloat(tail.xyz);
  packed.leaves = tail.w;
#endif
  return packed;
}

// A node of a geometry that is scaled by `scale`.
PackedNode fetch_packed_geometry(usamplerBuffer nodes, uint node, vec3 scale) {
  const int base = int(node * node_texels);
  PackedNode packed = packed_node_of(texelFetch(nodes, base), texelFetch(nodes, base + 1),
                                     texelFetch(nodes, base + 2), texelFetch(nodes, base + 3));
  packed.origin *= scale;
  packed.per_quantum /= scale;
  return packed;
}

// Sets bit 7 of each byte in which a is not below b.
uvec2 not_below(uvec2 a, uvec2 b) {
  const uint top = 0x80808080u;
  const uvec2 lower_bits = (a | top) - (b & ~top);
  return (a & ~b) | (~(a ^ b) & lower_bits);
}

// Packs bits 7, 15, 23 and 31 of both words into one bit per child.
uint child_mask(uvec2 bits) {
  const uvec2 apart = bits >> 7u & 0x01010101u;
  return (apart.x * 0x01020408u >> 24 & 0xFu) | (apart.y * 0x01020408u >> 20 & 0xF0u);
}

uvec2 in_each_byte(float quanta) { return uvec2(uint(int(quanta)) * 0x01010101u); }

// The children whose boxes may meet the box between two corners; never misses one.
uint children_meeting(PackedNode node, vec3 lo, vec3 hi) {
  const vec3 first = ceil((lo - node.overhang - node.origin) * node.per_quantum - node.below);
  const vec3 last = floor((hi + node.overhang - node.origin) * node.per_quantum + node.above);
  const vec3 first_byte = clamp(first, 0.0, 255.0);
  const vec3 last_byte = clamp(last, 0.0, 255.0);
  uvec2 meets = uvec2(~0u);
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
    meets &= not_below(node.edges[axis].zw, in_each_byte(first_byte[axis])) &
             not_below(in_each_byte(last_byte[axis]), node.edges[axis].xy);
  }
  const bool beyond = any(greaterThan(first, vec3(255.0))) || any(lessThan(last, vec3(0.0)));
  return beyond ? 0u : child_mask(meets) & node.used;
}

// The children whose boxes certainly lie within the box between two corners.
uint children_inside(PackedNode node, vec3 lo, vec3 hi) {
  const vec3 first = ceil((lo + node.overhang - node.origin) * node.per_quantum + node.above);
  const vec3 last = floor((hi - node.overhang - node.origin) * node.per_quantum - node.below);
  const vec3 first_byte = clamp(first, 0.0, 255.0);
  const vec3 last_byte = clamp(last, 0.0, 255.0);
  uvec2 inside = uvec2(~0u);
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
    inside &= not_below(node.edges[axis].xy, in_each_byte(first_byte[axis])) &
              not_below(in_each_byte(last_byte[axis]), node.edges[axis].zw);
  }
  const bool beyond = any(greaterThan(first, vec3(255.0))) || any(lessThan(last, vec3(0.0)));
  return beyond ? 0u : child_mask(inside) & node.used;
}

#endif
