// Wide BVH nodes and references, shared by host and GPU.
//
// A node has 96 bytes, 6 texels of uvec4 (layout after Ylitie, Karras and Laine 2017, "Efficient Incoherent
// Ray Traversal on GPUs Through Compressed Wide BVHs", with plain references instead of base + offset):
//   0    origin x y z (float bits), exponents of the quantum x | y << 8 | z << 16 (biased by 127),
//        one bit per slot with a child << 24
//   1-3  per axis: low edges of children 0-3, of 4-7, high edges of 0-3, of 4-7, one byte each, in quanta
//        from the origin
//   4-5  references of children 0-3, 4-7
// The quantized box of a child contains its box with a margin of more than 1e-3 quantum on every side, so
// that rounding in the traversal never misses it. build/slots.glsl assigns children to slots.
//
// A node of a TLAS has 4 more texels: 1-3 hold the edges at the begin of the TLAS's window and 6-8 those at
// its end, in the same quanta from the same origin. An entity's triangles always lie inside the linear mix of
// both, so a query at any instant of the window tests that mix. For a window of one instant, 1-3 are
// sufficient, and 6-8 hold the edges of the box around the centres of the child's entities. Texel 9, xyz: how
// far along each axis the oriented bounds of entities below may exceed the boxes of their children, metres as
// float bits; searches by bounds enlarge those boxes by it. w: one bit per child that is an entity.
// References of a TLAS's node count nodes of the slot's own buffer, those of a geometry's node count in the
// pool.
#ifndef RTSTDB_SHARED_NODE_H
#define RTSTDB_SHARED_NODE_H
#include "shared/interop.h"

RTSTDB_CONSTANT(node_width, 8)
RTSTDB_CONSTANT(node_texels, 6)
RTSTDB_CONSTANT(tlas_node_texels, 10)
RTSTDB_CONSTANT(motion_box_texels, 4)

// A reference: a node (bit 31 clear), a run of triangles, an instance, or none.
RTSTDB_CONSTANT(ref_leaf_bit, 0x80000000u)
RTSTDB_CONSTANT(ref_instance_bit, 0x40000000u)
RTSTDB_CONSTANT(ref_triangle_count_shift, 26)
RTSTDB_CONSTANT(ref_triangle_first_mask, 0x03FFFFFFu)
RTSTDB_CONSTANT(ref_instance_mask, 0x00FFFFFFu)
RTSTDB_CONSTANT(ref_none, 0xFFFFFFFFu)

// Triangles: 3 texels of vec4: corner 0 and the triangle's index (as bits), corner 1 and whether it has no
// area (as bits), corner 2.
RTSTDB_CONSTANT(triangle_texels, 3)
RTSTDB_CONSTANT(triangle_without_area, 1u)
RTSTDB_CONSTANT(max_triangles_per_leaf, 4)

#endif
