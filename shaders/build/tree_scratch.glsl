// The buffers of the tree builder. Every pass has the same bindings. The n primitives are the triangles of a
// geometry or, with BUILD_TLAS defined, instances. Passes that write the tree include this file with
// TREE_WRITES defined; they load the tree as whole texels and store to it by address, two words at once,
// since storage accesses on lavapipe go word by word.
//
//   sorted        upper words of the Morton codes with their primitives' numbers, sorted, in the first half
//                 (see sort.glsl)
//   words         lower words of the codes by primitive; later, for a geometry, the triangles in leaf order
//   offsets       counts of the sort; then, per pair of neighbours in sorted order, how early their codes
//                 differ; then the number of inner children of each workgroup of a level
//   bounds        for a TLAS, corners of boxes, among them those of its instances
//   tree          4 texels for each of n inner nodes, one of which is unused: box and costs (see
//                 tree_cost.glsl); then 2 for each of the n leaves in sorted order: its box. Inner node g
//                 separates the leaves g and g + 1 of the sorted order (Apetrei 2014). Nodes are identified
//                 by their index here, leaves from n on
//   binary        per inner node: left and right child
//   arrivals      per inner node: the end of the range of the child that arrived first
//   queue         per wide node: its binary node, its first primitive in leaf order, which of its children
//                 are inner (bits 0-7) and their number (from bit 8 on), and the index of the first inner
//                 child
//   children      per wide node: 8 binary nodes
//   wide          for a TLAS: its nodes. The nodes of a geometry, and its triangles in leaf order, are
//                 written to args.target
#ifndef RTSTDB_BUILD_TREE_SCRATCH_GLSL
#define RTSTDB_BUILD_TREE_SCRATCH_GLSL
#include "common/bounds.glsl"
#include "common/fence.glsl"
#include "common/pairs.glsl"
#include "shared/blas.h"
#include "shared/node.h"

#ifdef BUILD_TLAS
layout(set = 0, binding = 0, scalar) readonly buffer BoundsBuffer { float bounds[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer WideBuffer { uvec4 wide[]; };
#else
layout(set = 0, binding = 0) uniform usamplerBuffer corners;  // and the triangle's index
layout(set = 0, binding = 1) uniform samplerBuffer positions;
#endif
layout(set = 0, binding = 2, scalar) buffer SortedBuffer { uvec2 sorted[]; };
layout(set = 0, binding = 3, scalar) buffer WordsBuffer { uint words[]; };
layout(set = 0, binding = 4, scalar) buffer OffsetsBuffer { uint offsets[]; };
#ifdef TREE_WRITES
layout(set = 0, binding = 5, rgba32ui) coherent uniform uimageBuffer tree;
layout(set = 0, binding = 6, scalar) coherent buffer BinaryBuffer { uvec2 binary[]; };
#else
layout(set = 0, binding = 5) uniform usamplerBuffer tree;
layout(set = 0, binding = 6) uniform usamplerBuffer binary;
#endif
layout(set = 0, binding = 7, scalar) coherent buffer ArrivalsBuffer { uint arrivals[]; };
layout(set = 0, binding = 8, scalar) buffer QueueBuffer { uvec4 queue[]; };
layout(set = 0, binding = 9, scalar) buffer StateBuffer { uint state[]; };
layout(set = 0, binding = 10, scalar) buffer ChildrenBuffer { uvec4 children[]; };

layout(push_constant, scalar) uniform Push { BlasArgs args; };

const uint no_node = 0xFFFFFFFFu;

bool is_leaf(uint node) { return node >= args.count; }

// The first texel of a node.
int texel_of(uint node) { return int(is_leaf(node) ? 2u * (node + args.count) : 4u * node); }

#ifdef TREE_WRITES
uvec4 tree_texel(int place) { return imageLoad(tree, place); }
uvec2 children_of(uint node) { return binary[node]; }
#else
uvec4 tree_texel(int place) { return texelFetch(tree, place); }
uvec2 children_of(uint node) {
  const uvec4 of_two = texelFetch(binary, int(node >> 1));
  return (node & 1u) != 0u ? of_two.zw : of_two.xy;
}
#endif

Box box_of(uint node) {
  const int texel = texel_of(node);
  return Box(uintBitsToFloat(tree_texel(texel).xyz), uintBitsToFloat(tree_texel(texel + 1).xyz));
}

#ifdef BUILD_TLAS
Box box_of_primitive(uint primitive) {
  const uint place = args.box_first + primitive * args.box_stride;
  return Box(vec3(bounds[place], bounds[place + 1u], bounds[place + 2u]),
             vec3(bounds[place + 3u], bounds[place + 4u], bounds[place + 5u]));
}
#else
vec3 position(uint corner) { return texelFetch(positions, int(corner)).xyz; }
Box box_of_primitive(uint primitive) {
  const uvec4 c = texelFetch(corners, int(primitive));
  const vec3 p = position(c.x);
  const vec3 q = position(c.y);
  const vec3 r = position(c.z);
  return Box(min(p, min(q, r)), max(p, max(q, r)));
}
#endif

// A pass may consist of several dispatches.
uint workgroup() { return args.first + gl_WorkGroupID.x; }

// The primitives that this workgroup processes.
uint tile_begin() { return workgroup() * blas_tile + gl_LocalInvocationID.x; }
uint tile_end() { return min((workgroup() + 1u) * blas_tile, args.count); }

// The leaves from which this invocation climbs the tree, one after the other.
uint run_begin() { return (workgroup() * 64u + gl_LocalInvocationID.x) * blas_run; }
uint run_end() { return min(run_begin() + blas_run, args.count); }

#endif
