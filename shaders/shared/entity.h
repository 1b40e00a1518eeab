// Entities on the device (paper, Table 1, with what motion as a function of time adds).
#ifndef RTSTDB_SHARED_ENTITY_H
#define RTSTDB_SHARED_ENTITY_H
#include "shared/interop.h"

// One row as the host writes it. `valid_from` is the instant from which the motion holds, int64 nanoseconds, low word first.
// The low parts are what single precision leaves over: a motion may have held for long. Shaders read a row as 8 texels.
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

// One geometry: root of its BLAS and its box in the entity frame, unscaled; `closed`: 1 when it bounds a body. Then how far it
// reaches through the edges and the corners of a cube, as rtstdb/geometry/extents.hpp has it: edges by the axis along which a
// direction has no component, corners by the sign of x. Shaders read it as 7 texels.
#define RTSTDB_FIELDS_GeometryRecord(F) \
  F(vec3, box_center_m)                 \
  F(uint, root)                         \
  F(vec3, box_half_m)                   \
  F(uint, closed)                       \
  F(vec4, edges_yz_m)                   \
  F(vec4, edges_xz_m)                   \
  F(vec4, edges_xy_m)                   \
  F(vec4, corners_plus_x_m)             \
  F(vec4, corners_minus_x_m)
RTSTDB_STRUCT(GeometryRecord)
RTSTDB_CONSTANT(geometry_texels, 7)

// An instance is an entity at an epoch: one of the instants that are whole seconds of world time. A window, never longer than a
// second, meets at most two of the stretches between them, and each entity has an instance for either: at its place, and at
// its place + late_base. It stands where it is at the epoch, or where its motion begins (`from`, nanoseconds after the epoch), when
// that lies before the next one. So what an instant sees depends neither on the window that it came in nor on who asked before.
// 7 texels of vec4:
//   0 position, mask        1 orientation (xyzw)     2 velocity, BLAS root      3 angular velocity, entity index
//   4 scale, from | closed  5 box centre, -          6 box half extent, -       (box: entity frame, unscaled)
RTSTDB_CONSTANT(instance_texels, 7)
RTSTDB_CONSTANT(instance_closed_bit, 0x80000000u)
// The bounds of an entity at the one instant of a window, 3 texels of vec4:
//   0 centre, mask          1 half extent, entity index                      2 orientation (xyzw)
RTSTDB_CONSTANT(still_bounds_texels, 3)
// Their centre at that instant, 2 texels of vec4:
//   0 centre, mask          1 its velocity, entity index
RTSTDB_CONSTANT(still_center_texels, 2)
// Epochs lie this far apart.
RTSTDB_CONSTANT(epoch_length_ns, 1000000000)

#define RTSTDB_FIELDS_ApplyRowsArgs(F) \
  F(uint, first)                       \
  F(uint, count)
RTSTDB_STRUCT(ApplyRowsArgs)

// Instances, and their bounds over [window begin, window begin + window_s].
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
