// The buffers of the builder of small TLAS trees.
//
// A build of n primitives, with the example n = 4 and centres a < b < c < d on a line:
//   bounds        n boxes                                                     boxes of primitives 0..3
//   keys, values  Morton codes and primitive numbers, sorted together         [a b c d], [2 0 3 1]
//   binary        n-1 inner nodes: left, right, first, last; 0 is the root.   root {1, 2, 0, 3},
//                 A child with bit 31 is a leaf, numbered in sorted order     {leaf 0, leaf 1, 0, 1}, ...
//   parents       of n-1 inner nodes, then of n leaves
//   node_bounds   boxes of the inner nodes
//   arrivals      per inner node: the number of finished children
//   queue         collapse: (binary node, wide node) of this level and the next
//   offsets       collapse: position in the next level of each wide node's first inner child
//   wide          the slot's nodes, which queries read, as words of uvec4
#ifndef RTSTDB_BUILD_SCRATCH_GLSL
#define RTSTDB_BUILD_SCRATCH_GLSL
#include "common/bounds.glsl"
#include "shared/build.h"
#include "shared/node.h"

layout(set = 0, binding = 0, scalar) buffer BoundsBuffer { Box bounds[]; };
layout(set = 0, binding = 1, scalar) buffer KeysBuffer { uvec2 keys[]; };
layout(set = 0, binding = 2, scalar) buffer ValuesBuffer { uint values[]; };
layout(set = 0, binding = 3, scalar) buffer BinaryBuffer { uvec4 binary[]; };
layout(set = 0, binding = 4, scalar) buffer ParentsBuffer { uint parents[]; };
layout(set = 0, binding = 5, scalar) coherent buffer NodeBoundsBuffer { Box node_bounds[]; };
layout(set = 0, binding = 6, scalar) coherent buffer ArrivalsBuffer { uint arrivals[]; };
layout(set = 0, binding = 7, scalar) buffer QueueBuffer { uvec2 queue[]; };
layout(set = 0, binding = 8, scalar) buffer OffsetsBuffer { uint offsets[]; };
layout(set = 0, binding = 9, scalar) buffer WideBuffer { uvec4 wide[]; };

const uint leaf_child_bit = 0x80000000u;

#endif
