// The buffers of the tree builder, the same bindings in every pass, and what each holds for n primitives: the triangles of a
// geometry, or, with BUILD_TLAS defined, instances.
//
//   keys, values  words of the Morton codes in four parts (see sort.glsl) and the primitives' numbers in two halves, sorted together;
//                 afterwards the second half of the values of a geometry is the order of the triangles in the leaves; costs_low lies
//                 where the keys were
//   offsets       counts of the sort; then, per gap between neighbours in sorted order, how early their codes part; then the
//                 inner children of each workgroup of a level
//   bounds        of a TLAS, boxes among which are those of its instances
//   box_lo, _hi   boxes of the n inner nodes, of which one is not used, then of the n leaves in sorted order. Inner node g
//                 parts the leaves in sorted order between g and g + 1 (Apetrei 2014); nodes are named by their place here
//   binary        inner nodes: left, right, primitives below, how the cost is had (see tree_choice.glsl)
//   arrivals      per inner node: where the range of the child ends that came first
//   costs         per inner node: what it costs as 1..4 and as 5..7 children of a wide node; primitives below, as bits
//   queue         per wide node: its binary node, its first primitive in the order of the leaves, which of its children are
//                 inner (bits 0-7) and how many it has (from bit 8 on), and where the first inner child stands
//   children      per wide node: 8 binary nodes
//   wide          a part of the wide nodes, on its way to the pool; of a TLAS, the nodes themselves
//   triangles     a part of the triangles in the order of the leaves, on its way to the pool
#ifndef RTSTDB_BUILD_TREE_SCRATCH_GLSL
#define RTSTDB_BUILD_TREE_SCRATCH_GLSL
#include "common/bounds.glsl"
#include "common/fence.glsl"
#include "shared/blas.h"
#include "shared/node.h"

#ifdef BUILD_TLAS
layout(set = 0, binding = 0, scalar) readonly buffer BoundsBuffer { Box bounds[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer WideBuffer { uvec4 wide[]; };
layout(set = 0, binding = 13, scalar) buffer ChildrenBuffer { uvec4 children[]; };
#else
layout(set = 0, binding = 0) uniform usamplerBuffer corners;  // with the triangle's own number
layout(set = 0, binding = 1) uniform samplerBuffer positions;
layout(set = 0, binding = 13, scalar) writeonly buffer WideBuffer { uvec4 wide[]; };
layout(set = 0, binding = 14, scalar) writeonly buffer TrianglesBuffer { vec4 triangles[]; };
layout(set = 0, binding = 15, scalar) buffer ChildrenBuffer { uvec4 children[]; };
#endif
layout(set = 0, binding = 2, scalar) buffer KeysBuffer { uint keys[]; };
layout(set = 0, binding = 3, scalar) buffer ValuesBuffer { uint values[]; };
layout(set = 0, binding = 4, scalar) buffer OffsetsBuffer { uint offsets[]; };
layout(set = 0, binding = 5, scalar) coherent buffer BoxLoBuffer { vec3 box_lo[]; };
layout(set = 0, binding = 6, scalar) coherent buffer BoxHiBuffer { vec3 box_hi[]; };
layout(set = 0, binding = 7, scalar) coherent buffer BinaryBuffer { uvec4 binary[]; };
layout(set = 0, binding = 8, scalar) coherent buffer ArrivalsBuffer { uint arrivals[]; };
layout(set = 0, binding = 9, scalar) coherent buffer CostsLowBuffer { vec4 costs_low[]; };
layout(set = 0, binding = 10, scalar) coherent buffer CostsHighBuffer { vec4 costs_high[]; };
layout(set = 0, binding = 11, scalar) buffer QueueBuffer { uvec4 queue[]; };
layout(set = 0, binding = 12, scalar) buffer StateBuffer { uint state[]; };

layout(push_constant, scalar) uniform Push { BlasArgs args; };

const uint nobody = 0xFFFFFFFFu;

bool is_leaf(uint node) { return node >= args.count; }

Box box_of(uint node) { return Box(box_lo[node], box_hi[node]); }

#ifdef BUILD_TLAS
Box box_of_primitive(uint primitive) {
  const uint place = args.box_first + primitive * args.box_stride;
  return Box(bounds[place].lo, bounds[place].hi);
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

// A pass may be several dispatches.
uint workgroup() { return args.first + gl_WorkGroupID.x; }

// The primitives that this workgroup visits.
uint tile_begin() { return workgroup() * blas_tile + gl_LocalInvocationID.x; }
uint tile_end() { return min((workgroup() + 1u) * blas_tile, args.count); }

// Where the tree is climbed: the leaves from which this invocation sets out, one after the other.
uint run_begin() { return (workgroup() * 64u + gl_LocalInvocationID.x) * blas_run; }
uint run_end() { return min(run_begin() + blas_run, args.count); }

#endif
