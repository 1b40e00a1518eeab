// What queries carry to the device and back.
#ifndef RTSTDB_SHARED_QUERY_H
#define RTSTDB_SHARED_QUERY_H
#include "shared/interop.h"

RTSTDB_CONSTANT(no_entity, 0xFFFFFFFFu)
RTSTDB_CONSTANT(status_miss, 0)
RTSTDB_CONSTANT(status_hit, 1)
RTSTDB_CONSTANT(status_incomplete, 2)

// Read as 3 texels of vec4.
#define RTSTDB_FIELDS_RayRecord(F)                        \
  F(vec3, origin_m)                                       \
  F(float, lambda_min)                                    \
  F(vec3, direction)                                      \
  F(float, lambda_max)                                    \
  F(float, t_s) /* since the epoch of the instances that it sees */ \
  F(uint, mask)                                           \
  F(uint, carrier)                                        \
  F(uint, instance_base) /* 0 or late_base */
RTSTDB_STRUCT(RayRecord)

#define RTSTDB_FIELDS_HitRecord(F) \
  F(uint, status)                  \
  F(float, lambda)                 \
  F(float, u)                      \
  F(float, v)                      \
  F(uint, entity)                  \
  F(uint, triangle)                \
  F(uint, front_face)              \
  F(vec3, n_world)                 \
  F(vec3, v_relative_mps)
RTSTDB_STRUCT(HitRecord)

#define RTSTDB_FIELDS_RayArgs(F)                                         \
  F(uint, root)                                                          \
  F(uint, count)                                                         \
  F(uint, alone)  /* 1: one ray a workgroup */                           \
  F(uint, two)    /* see loops_still_turn */
RTSTDB_STRUCT(RayArgs)

RTSTDB_CONSTANT(region_is_sphere, 1)
RTSTDB_CONSTANT(region_wants_inside, 2)

#define RTSTDB_FIELDS_RegionRecord(F) \
  F(vec3, center_m)                   \
  F(uint, flags)                      \
  F(vec3, half_extent_m)              \
  F(uint, mask)                       \
  F(vec4, q)                          \
  F(float, t_s)                       \
  F(uint, carrier)                    \
  F(uint, excluded)                   \
  F(uint, instance_base)
RTSTDB_STRUCT(RegionRecord)

// Followed in the id buffer by `capacity` ids of each region.
#define RTSTDB_FIELDS_RegionCount(F) \
  F(uint, found)                     \
  F(uint, incomplete)
RTSTDB_STRUCT(RegionCount)

#define RTSTDB_FIELDS_RegionArgs(F) \
  F(uint, root)                     \
  F(uint, count)                    \
  F(uint, capacity)                 \
  F(uint, alone) /* 1: one region a workgroup */ \
  F(uint, two)   /* see loops_still_turn */
RTSTDB_STRUCT(RegionArgs)

#endif
