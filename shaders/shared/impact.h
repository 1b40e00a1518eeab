// Requests and results of impact queries.
#ifndef RTSTDB_SHARED_IMPACT_H
#define RTSTDB_SHARED_IMPACT_H
#include "shared/interop.h"

// A body whose candidates are searched: its bounding sphere at the begin of the window, and its velocity.
#define RTSTDB_FIELDS_SweepRecord(F)                           \
  F(vec3, p_m)                                                 \
  F(float, reach_m) /* radius, with the tolerance */           \
  F(vec3, v_mps)                                               \
  F(float, window_s)                                           \
  F(uint, mask)                                                \
  F(uint, excluded)                                            \
  F(int, t_ns) /* since the epoch of the instances it sees */  \
  F(uint, instance_base)
RTSTDB_STRUCT(SweepRecord)

#define RTSTDB_FIELDS_SweepArgs(F)                     \
  F(uint, first) /* workgroup 0 searches this place */ \
  F(uint, end)                                         \
  F(uint, instances) /* in the tree */                 \
  F(uint, capacity) /* ids for each search */          \
  F(uvec2, halt) /* this and the next as in RayArgs */ \
  F(uint, halt_from)                                   \
  F(uint, loop_probe) /* see loops_still_turn */
RTSTDB_STRUCT(SweepArgs)

// A pair in world axes, relative to the second entity's origin; poses at the begin of the window. The low
// parts are the remainders of single precision. `first_body`, `second_body`: of convex parts the texels of
// the hulls, of surfaces the indices of the geometries. Reaches: from the origins to the farthest points of
// the geometries.
#define RTSTDB_FIELDS_AdvanceRecord(F) \
  F(vec4, q_first)                     \
  F(vec4, q_second)                    \
  F(vec3, w_first_radps)               \
  F(uint, first_body)                  \
  F(vec3, w_second_radps)              \
  F(uint, second_body)                 \
  F(vec3, first_scale)                 \
  F(float, tolerance_m)                \
  F(vec3, second_scale)                \
  F(float, window_s)                   \
  F(vec3, p_m)                         \
  F(float, first_reach_m)              \
  F(vec3, p_low_m)                     \
  F(float, second_reach_m)             \
  F(vec3, v_mps)                       \
  F(vec3, v_low_mps)
RTSTDB_STRUCT(AdvanceRecord)

RTSTDB_CONSTANT(advance_goes_on, 0)
RTSTDB_CONSTANT(advance_meets, 1)
RTSTDB_CONSTANT(advance_ends, 2)       // the window ends first
RTSTDB_CONSTANT(advance_undecided, 3)  // a distance was not found
RTSTDB_CONSTANT(advance_unfinished, 4) // limit of loops: retried
// A pair of convex parts makes up to steps_per_stage steps in a stage, fewer where they take many rounds. A
// pair of surfaces makes as many steps as fit into the work of a stage, and a step may go on in later stages.
// There are as many stages as the pairs need, so the result does not depend on where a stage ends. A pair
// that reaches the maximum number of steps is undecided.
RTSTDB_CONSTANT(max_advance_steps, 4096)
RTSTDB_CONSTANT(steps_per_stage, 8)

// `time_s`: a double, low word first; up to it the bodies do not meet. `point_m`: of the first body, from its
// origin. `phase`: of a pair of surfaces.
#define RTSTDB_FIELDS_AdvanceState(F) \
  F(uvec2, time_s)                    \
  F(uint, state)                      \
  F(uint, steps) /* made so far */    \
  F(float, distance_m)                \
  F(vec3, n)                          \
  F(vec3, point_m)                    \
  F(uint, phase)
RTSTDB_STRUCT(AdvanceState)

RTSTDB_CONSTANT(surfaces_begin, 0)         // whether one body lies within the other is not tested yet
RTSTDB_CONSTANT(surfaces_between_steps, 1)
RTSTDB_CONSTANT(surfaces_in_step, 2)       // the search of the step is paused

// Pairs of surfaces that are searched at a time; each has a slot for its paused search.
RTSTDB_CONSTANT(max_surface_slots, 1024)

#define RTSTDB_FIELDS_ActiveSurfaces(F) \
  F(uint, pair)                         \
  F(uint, slot)
RTSTDB_STRUCT(ActiveSurfaces)

#define RTSTDB_FIELDS_SurfaceAdvanceArgs(F)                       \
  F(uint, first) /* see place_of_invocation */                    \
  F(uint, end)                                                    \
  F(uint, per_group)                                              \
  F(uvec2, halt) /* this and the next as in RayArgs */            \
  F(uint, halt_from)                                              \
  F(uint, loop_probe) /* see loops_still_turn */                  \
  F(uvec2, shapes) /* of the geometries: GeometryPool::shown() */
RTSTDB_STRUCT(SurfaceAdvanceArgs)

// A subtree of each of both surfaces (shaders/query/impact/surface_approach.glsl).
#define RTSTDB_FIELDS_SubtreePair(F)                                             \
  F(uint, first)                                                                 \
  F(uint, second)                                                                \
  F(float, after_s) /* no sooner can they be nearer than half the tolerance */
RTSTDB_STRUCT(SubtreePair)

// The search of a step, and the pairs that it has to visit, the next one last. It goes on if the trees are
// those of `shapes`, and else begins again.
RTSTDB_CONSTANT(max_subtree_pairs, 192)
#define RTSTDB_FIELDS_ApproachSearch(F)                                            \
  F(uvec2, shapes)                                                                 \
  F(uint, pending)   /* number of these pairs */                                   \
  F(uint, visits)                                                                  \
  F(float, after_s)  /* least one of the pairs of triangles that were visited */   \
  F(float, square)   /* of the distance of the nearest two within the tolerance */ \
  F(vec3, first)     /* the nearest point of the first one of these */             \
  F(vec3, between)   /* from that of the second one */
RTSTDB_STRUCT(ApproachSearch)

#endif
