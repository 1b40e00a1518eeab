// First-order distance fields on the device, and the distances from which they are built.
#ifndef RTSTDB_SHARED_FIELD_H
#define RTSTDB_SHARED_FIELD_H
#include "shared/interop.h"

// A brick divides a coarse cell into this many cells along each axis. Equals field_cells_per_brick of
// rtstdb/limits.hpp.
RTSTDB_CONSTANT(field_brick_cells, 5)
RTSTDB_CONSTANT(field_brick_vertices, 6)

// All fields lie in one pool of texels of uvec4. A vertex is half a texel: the distance (float bits), and the
// gradient, a unit vector (octahedral, two signed 16-bit parts). Vertices are numbered along x, then y, then
// z, and each row along x begins with a texel of its own.
//   header, field_header_texels:
//     0 origin xyz, edge of a coarse cell (float bits)    1 coarse cells xyz, signed
//     2 first texel of the cells, of the coarse vertices and of the bricks, -
//   cells: one word each, along x, then y, then z: the number of its brick, or field_none
//   coarse vertices
//   bricks, field_brick_texels each
RTSTDB_CONSTANT(field_header_texels, 3)
RTSTDB_CONSTANT(field_brick_texels, 108)
RTSTDB_CONSTANT(field_none, 0xFFFFFFFFu)

// A point whose distance to a geometry is computed, in the frame of the geometry.
#define RTSTDB_FIELDS_FieldPoint(F) \
  F(vec3, point_m)                  \
  F(float, radius_m) /* triangles farther away are not found */
RTSTDB_STRUCT(FieldPoint)

// The distance at a point, and its gradient. A point without a triangle within its radius has the distance
// 3.4e38. A search that was cut short has the gradient zero.
#define RTSTDB_FIELDS_FieldSample(F) \
  F(vec3, gradient)                  \
  F(float, distance_m)
RTSTDB_STRUCT(FieldSample)

// The directions of the ray ratio.
RTSTDB_CONSTANT(field_sign_directions, 64)

#define RTSTDB_FIELDS_FieldArgs(F)                                                     \
  F(uint, root)                                                                        \
  F(uint, first) /* see place_of_invocation */                                         \
  F(uint, end)                                                                         \
  F(uint, per_group)                                                                   \
  F(float, front_sign) /* 1 if fronts are outside, else -1 */                          \
  F(float, slack)   /* the relative error by which a distance may be too large, to end searches sooner */ \
  F(float, inside_ratio) /* the least share of rays that hit from behind at a point inside */ \
  F(uint, loop_probe) /* see loops_still_turn */
RTSTDB_STRUCT(FieldArgs)

#endif
