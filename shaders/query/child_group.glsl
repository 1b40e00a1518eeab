// A group is some children of one node in one word: the node in the upper 24 bits, below it one bit per
// child. One word, because lavapipe stores lane by lane where the address differs between lanes.
#ifndef RTSTDB_QUERY_CHILD_GROUP_GLSL
#define RTSTDB_QUERY_CHILD_GROUP_GLSL
#include "shared/node.h"

// Removes one child from a group and returns its reference. `texels`: of one node.
uint take_child(usamplerBuffer of, uint texels, inout uint group) {
  const uint rest = group & (group - 1u);
  // The exponent of a power of two is the index of its bit.
  const uint slot = uint(floatBitsToInt(float(int(group ^ rest))) >> 23) - 127u;
  const uvec4 refs = texelFetch(of, int((group >> 8) * texels + 4u + (slot >> 2)));
  const uint low = (slot & 1u) != 0u ? refs.y : refs.x;
  const uint high = (slot & 1u) != 0u ? refs.w : refs.z;
  group = rest;
  return (slot & 2u) != 0u ? high : low;
}

// The references of a node's children.
struct References {
  uvec4 first;
  uvec4 second;
};

References fetch_references(usamplerBuffer of, uint texels, uint node) {
  const int base = int(node * texels + 4u);
  return References(texelFetch(of, base), texelFetch(of, base + 1));
}

// One bit per slot that holds a leaf or no child.
uint leaf_mask(References references) {
  const uvec4 first = references.first >> 31;
  const uvec4 second = references.second >> 31;
  return first.x | first.y << 1 | first.z << 2 | first.w << 3 | second.x << 4 | second.y << 5 |
         second.z << 6 | second.w << 7;
}

#endif
