// Entities on the device (paper, Table 1, with what motion as a function of time adds).
#ifndef RTSTDB_SHARED_ENTITY_H
#define RTSTDB_SHARED_ENTITY_H
#include "shared/interop.h"

// One row as the host writes it. `valid_from` is the instant from which the motion holds, int64 nanoseconds, low word first.
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
  F(uvec2, valid_from)
RTSTDB_STRUCT(EntityRecord)

// One geometry: root of its BLAS and its box in the entity frame, unscaled.
#define RTSTDB_FIELDS_GeometryRecord(F) \
  F(vec3, box_center_m)                 \
  F(uint, root)                         \
  F(vec3, box_half_m)                   \
  F(uint, reserved)
RTSTDB_STRUCT(GeometryRecord)

// An instance is an entity at the begin of a structure's window, 7 texels of vec4:
//   0 position, mask        1 orientation (xyzw)     2 velocity, BLAS root      3 angular velocity, entity index
//   4 scale, -              5 box centre, -          6 box half extent, -       (box: entity frame, unscaled)
RTSTDB_CONSTANT(instance_texels, 7)

#define RTSTDB_FIELDS_ApplyRowsArgs(F) F(uint, count)
RTSTDB_STRUCT(ApplyRowsArgs)

// Instances and their bounds over [window begin, window begin + window_s].
#define RTSTDB_FIELDS_InstanceArgs(F) \
  F(uvec2, window_begin)              \
  F(float, window_s)                  \
  F(uint, count)         /* live entities */ \
  F(uint, visible_count) /* of them with a geometry, standing first */
RTSTDB_STRUCT(InstanceArgs)

#endif
