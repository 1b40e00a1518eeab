// Entities on the device (paper, Table 1, extended by motion as a function of time).
#ifndef RTSTDB_SHARED_ENTITY_H
#define RTSTDB_SHARED_ENTITY_H
#include "shared/interop.h"

// One row as the host writes it. `valid_from` is the time from which the motion holds, int64 nanoseconds, low
// word first. The low parts are the remainders of single precision, which matter for motions that have held
// for long. Shaders read a row as 8 texels.
#define RTSTDB_FIELDS_EntityRecord(F) \
  F(vec3, p_world_m)                  \
  F(uint, mask)                       \
  F(vec4, q_world)                    \
  F(vec3, v_world_mps)                \
  F(uint, geometry)                   \
  F(vec3, w_world_radps)              \
  F(uint, index)                      \
  F(vec3, scale)                      \
  F(uint, material)                   \
  F(uvec2, valid_from)                \
  F(vec3, p_low_m)                    \
  F(vec3, v_low_mps)                  \
  F(vec3, w_low_radps)                \
  F(uint, unused)
RTSTDB_STRUCT(EntityRecord)
RTSTDB_CONSTANT(row_texels, 8)

// One geometry: the root of its BLAS and its box in the entity frame, unscaled; `closed` is 1 when it bounds
// a body. Then its extents along the edge and corner directions of a cube, as in rtstdb/geometry/extents.hpp:
// edges by the axis along which the direction has no component, corners by the sign of x. `field`: the first
// texel of its distance field (field.h), or field_none; `first_triangle`: of its leaf order, in the pool of
// triangles; `triangles`: their number; `attributes`: the first texel of its corner normals and colours
// (corner.h), or attributes_none. Shaders read it as 8 texels.
#define RTSTDB_FIELDS_GeometryRecord(F) \
  F(vec3, box_center_m)                 \
  F(uint, root)                         \
  F(vec3, box_half_m)                   \
  F(uint, closed)                       \
  F(vec4, edges_yz_m)                   \
  F(vec4, edges_xz_m)                   \
  F(vec4, edges_xy_m)                   \
  F(vec4, corners_plus_x_m)             \
  F(vec4, corners_minus_x_m)            \
  F(uint, field)                        \
  F(uint, first_triangle)               \
  F(uint, attributes)                   \
  F(uint, triangles)
RTSTDB_STRUCT(GeometryRecord)
RTSTDB_CONSTANT(geometry_texels, 8)

// An instance is the state of an entity for one epoch. Epochs are the whole seconds of world time. A window
// is never longer than a second, so it meets at most two of the stretches between epochs, and each entity has
// one instance per stretch: at index `place` and at `place` + late_base. The instance is stored for the
// epoch, or for the begin of its motion (`from`, nanoseconds after the epoch) if that lies before the next
// epoch. So results at an instant depend neither on the window nor on earlier queries. 7 texels of vec4:
//   0 position, mask        1 orientation (xyzw)     2 velocity, BLAS root
//   3 angular velocity, entity index
//   4 scale, from | closed  5 box centre, distance field         6 box half extent, geometry
// The box is in the entity frame, unscaled.
RTSTDB_CONSTANT(instance_texels, 7)
RTSTDB_CONSTANT(instance_closed_bit, 0x80000000u)
// The bounds of an entity at the instant of a window of one instant, 3 texels of vec4:
//   0 centre, mask          1 half extent, entity index                      2 orientation (xyzw)
RTSTDB_CONSTANT(still_bounds_texels, 3)
// The centre of these bounds, 2 texels of vec4:
//   0 centre, mask          1 its velocity, entity index
RTSTDB_CONSTANT(still_center_texels, 2)
// Distance between epochs.
RTSTDB_CONSTANT(epoch_length_ns, 1000000000)

#define RTSTDB_FIELDS_ApplyRowsArgs(F) \
  F(uint, first)                       \
  F(uint, count)
RTSTDB_STRUCT(ApplyRowsArgs)

// Arguments of the pass that computes instances and their bounds over [window begin, window begin +
// window_s].
#define RTSTDB_FIELDS_InstanceArgs(F) \
  F(uvec2, epoch)        /* the last one at or before the window's begin */ \
  F(uvec2, late_epoch)   /* the next one */ \
  F(uvec2, window_begin)              \
  F(float, window_s)                  \
  F(uint, meets_late)    /* 0: the window ends before the next epoch */ \
  F(uint, first)         /* place of the first one; 0 where places are listed */ \
  F(uint, count)         /* live entities, or places listed */ \
  F(uint, visible_count) /* of the live ones with a geometry, standing first */ \
  F(uint, listed)        /* 1: only the places listed are made */
RTSTDB_STRUCT(InstanceArgs)

#endif
