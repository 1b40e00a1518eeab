// Reads the boxes and references of the children of a wide node.
#ifndef RTSTDB_COMMON_WIDE_NODE_GLSL
#define RTSTDB_COMMON_WIDE_NODE_GLSL
#include "shared/node.h"

struct WideNode {
  vec3 origin;
  vec3 quantum;
  uvec4 edges[3];
  uvec4 references[2];
};

WideNode fetch_wide_node(usamplerBuffer nodes, uint node) {
  const int base = int(node * node_texels);
  const uvec4 head = texelFetch(nodes, base);
  WideNode wide;
  wide.origin = uintBitsToFloat(head.xyz);
  wide.quantum = vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
                      uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
  wide.edges[0] = texelFetch(nodes, base + 1);
  wide.edges[1] = texelFetch(nodes, base + 2);
  wide.edges[2] = texelFetch(nodes, base + 3);
  wide.references[0] = texelFetch(nodes, base + 4);
  wide.references[1] = texelFetch(nodes, base + 5);
  return wide;
}

uint edge_of(WideNode wide, uint axis, uint word, uint k) {
  return wide.edges[axis][word + (k >> 2)] >> 8u * (k & 3u) & 0xFFu;
}

vec3 child_lo(WideNode wide, uint k) {
  return wide.origin +
         wide.quantum * vec3(edge_of(wide, 0u, 0u, k), edge_of(wide, 1u, 0u, k), edge_of(wide, 2u, 0u, k));
}

vec3 child_hi(WideNode wide, uint k) {
  return wide.origin +
         wide.quantum * vec3(edge_of(wide, 0u, 2u, k), edge_of(wide, 1u, 2u, k), edge_of(wide, 2u, 2u, k));
}

// ref_none for a slot without a child.
uint child_reference(WideNode wide, uint k) { return wide.references[k >> 2][k & 3u]; }

// A node of a TLAS at one instant of its window.
struct MotionNode {
  WideNode begin;
  uvec4 end_edges[3];
  float share;    // fraction of the window that has passed
  uint used;      // one bit per child
  vec3 overhang;  // of oriented bounds beyond the children's boxes
};

MotionNode fetch_motion_node(usamplerBuffer tlas, uint node, float share) {
  const int base = int(node * tlas_node_texels);
  const uvec4 head = texelFetch(tlas, base);
  MotionNode wide;
  wide.begin.origin = uintBitsToFloat(head.xyz);
  wide.begin.quantum =
      vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
           uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
#ifdef NEAREST_STILL
    wide.begin.edges[axis] = texelFetch(tlas, base + 6 + axis);  // boxes around the centres
#else
    wide.begin.edges[axis] = texelFetch(tlas, base + 1 + axis);
    wide.end_edges[axis] = texelFetch(tlas, base + 6 + axis);
#endif
  }
  wide.begin.references[0] = texelFetch(tlas, base + 4);
  wide.begin.references[1] = texelFetch(tlas, base + 5);
  wide.share = share;
  wide.used = head.w >> 24;
#if defined(NEAREST_ENTITY) && !defined(NEAREST_STILL)
  wide.overhang = uintBitsToFloat(texelFetch(tlas, base + 9).xyz);
#else
  wide.overhang = vec3(0.0);
#endif
  return wide;
}

float edge_at(MotionNode wide, uint axis, uint word, uint k) {
  const float begin = float(int(edge_of(wide.begin, axis, word, k)));
#ifdef NEAREST_STILL
  return begin;
#else
  const float end = float(int(wide.end_edges[axis][word + (k >> 2)] >> 8u * (k & 3u) & 0xFFu));
  return begin + wide.share * (end - begin);
#endif
}

vec3 child_lo(MotionNode wide, uint k) {
  return wide.begin.origin + wide.begin.quantum * vec3(edge_at(wide, 0u, 0u, k), edge_at(wide, 1u, 0u, k),
                                                       edge_at(wide, 2u, 0u, k));
}

vec3 child_hi(MotionNode wide, uint k) {
  return wide.begin.origin + wide.begin.quantum * vec3(edge_at(wide, 0u, 2u, k), edge_at(wide, 1u, 2u, k),
                                                       edge_at(wide, 2u, 2u, k));
}

uint child_reference(MotionNode wide, uint k) { return wide.begin.references[k >> 2][k & 3u]; }

#endif
