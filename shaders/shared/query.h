// Requests and results of queries.
#ifndef RTSTDB_SHARED_QUERY_H
#define RTSTDB_SHARED_QUERY_H
#include "shared/interop.h"

RTSTDB_CONSTANT(no_entity, 0xFFFFFFFFu)
RTSTDB_CONSTANT(status_miss, 0)
RTSTDB_CONSTANT(status_hit, 1)
RTSTDB_CONSTANT(status_incomplete, 2)

// A ray in the layout of the caller (rtstdb::Ray), 4 texels:
//   0 origin, direction x                                     1 direction yz, lambda range
//   2 time (int64 ns, low word first), mask, carrier's index  3 -
RTSTDB_CONSTANT(ray_texels, 4)
// A hit in the layout of the caller (rtstdb::RayHit), 8 pairs of words:
//   0 status, lambda    2 entity's index, generation    4 triangle, front    6 normal z, relative velocity x
//   1 u, v              3 mask, material                5 normal xy          7 relative velocity yz
RTSTDB_CONSTANT(hit_pairs, 8)

// The number of rays that are retried at a time. The saved state of one search has two stacks of 96 groups
// and 18 more words, and 5 for each hit of its list. The upper bit of its word in `retried_rays` marks the
// begin of a search.
RTSTDB_CONSTANT(paused_rays, 256)
RTSTDB_CONSTANT(paused_ray_groups, 96)
RTSTDB_CONSTANT(paused_ray_words, 210)
RTSTDB_CONSTANT(paused_hit_words, 5)
RTSTDB_CONSTANT(ray_begins_bit, 0x80000000u)

#define RTSTDB_FIELDS_RayArgs(F)                                                                             \
  F(uint, root)                                                                                              \
  F(uint, first) /* see place_of_invocation */                                                               \
  F(uint, end)   /* one behind the last place */                                                             \
  F(uint, per_group)                                                                                         \
  F(uint, is_retry)  /* 1: places are those of `retried_rays`, and searches may pause; 0: places are rays */ \
  F(uint, epoch_ns)  /* low word, which suffices: times are less than two seconds after it */              \
  F(uint, late_base) /* where the next epoch's instances begin */                                            \
  F(uint, still)     /* 1: every ray has time still_ns */                                                    \
  F(uint, still_ns)  /* low word */                                                                          \
  F(uint, window_begin_ns) /* low word */                                                                    \
  F(float, per_window_ns)  /* 1 over the window's length; 0: the window is an instant */                     \
  F(uint, hits_per_ray)                                                                                      \
  F(uvec2, hits)      /* their address, low word first */                                                    \
  F(float, faces)     /* 0: both sides are hit, 1: fronts alone, -1: backs alone */                          \
  F(uvec2, halt)      /* HaltWords' address, low word first; 0: it is never halted */                        \
  F(uint, halt_from)  /* the number in the chunk of the element at place 0, which may wrap */                \
  F(uint, loop_probe) /* see loops_still_turn */
RTSTDB_STRUCT(RayArgs)

RTSTDB_CONSTANT(region_is_sphere, 1)
RTSTDB_CONSTANT(region_wants_inside, 2)
// REGION_PAIRS: entities with a higher index than `excluded` alone, so that each pair is found once.
RTSTDB_CONSTANT(region_above_excluded, 4)

#define RTSTDB_FIELDS_RegionRecord(F)                  \
  F(vec3, center_m)                                    \
  F(uint, flags)                                       \
  F(vec3, half_extent_m)                               \
  F(uint, mask)                                        \
  F(vec4, q)                                           \
  F(int, t_ns)                                         \
  F(uint, carrier)                                     \
  F(uint, excluded)                                    \
  F(uint, instance_base)                               \
  F(float, share)  /* of the window that has passed */ \
  F(float, near_m) /* frustum */
RTSTDB_STRUCT(RegionRecord)

// In the id buffer `capacity` ids of each region follow.
#define RTSTDB_FIELDS_RegionCount(F) \
  F(uint, found)                     \
  F(uint, incomplete)
RTSTDB_STRUCT(RegionCount)

#define RTSTDB_FIELDS_RegionArgs(F)                    \
  F(uint, root)                                        \
  F(uint, first) /* see place_of_invocation */         \
  F(uint, end)                                         \
  F(uint, per_group)                                   \
  F(uint, capacity)                                    \
  F(uvec2, halt) /* this and the next as in RayArgs */ \
  F(uint, halt_from)                                   \
  F(uint, loop_probe) /* see loops_still_turn */
RTSTDB_STRUCT(RegionArgs)

#endif
