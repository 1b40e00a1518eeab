// Requests and results of nearest queries.
#ifndef RTSTDB_SHARED_NEAREST_H
#define RTSTDB_SHARED_NEAREST_H
#include "shared/interop.h"

// Equals max_neighbors of rtstdb/limits.hpp.
RTSTDB_CONSTANT(list_size, 32)

#define RTSTDB_FIELDS_NearestRecord(F)                             \
  F(vec3, point_m)                                                 \
  F(float, radius_m)                                               \
  F(int, t_ns) /* since the epoch of the instances that it sees */ \
  F(uint, mask)                                                    \
  F(uint, carrier)                                                 \
  F(uint, excluded)      /* place of its instance */               \
  F(uint, instance_base) /* 0 or late_base */                      \
  F(float, share)        /* of the window that has passed */       \
  F(uint, place)         /* where its answer belongs */
RTSTDB_STRUCT(NearestRecord)

#define RTSTDB_FIELDS_NearestCount(F) \
  F(uint, found)                      \
  F(uint, incomplete)
RTSTDB_STRUCT(NearestCount)

// `k` results per point in the layout that the caller reads (rtstdb/query.hpp, Neighbor). Written as pairs of
// words.
#define RTSTDB_FIELDS_NeighborRecord(F)    \
  F(uvec2, entity) /* index, generation */ \
  F(uint, mask)                            \
  F(uint, material)                        \
  F(uint, triangle)                        \
  F(float, distance_m)                     \
  F(float, u)                              \
  F(float, v)                              \
  F(uint, has_sign)                        \
  F(vec3, p_world_m)                       \
  F(vec3, v_relative_mps)                  \
  F(uint, unused)
RTSTDB_STRUCT(NeighborRecord)
RTSTDB_CONSTANT(neighbor_pairs, 8)

#define RTSTDB_FIELDS_NearestArgs(F)                                                                 \
  F(uint, root)                                                                                      \
  F(uint, first) /* see place_of_invocation; a place for each point, or for each neighbor of each */ \
  F(uint, end)                                                                                       \
  F(uint, per_group)                                                                                 \
  F(uint, k)                                                                                         \
  F(uvec2, neighbors) /* their address, low word first */                                            \
  F(uvec2, halt)      /* this and the next as in RayArgs */                                          \
  F(uint, halt_from)                                                                                 \
  F(uint, loop_probe) /* see loops_still_turn */
RTSTDB_STRUCT(NearestArgs)

#endif
