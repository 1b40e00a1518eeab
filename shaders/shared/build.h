// Arguments of the passes that build structures.
#ifndef RTSTDB_SHARED_BUILD_H
#define RTSTDB_SHARED_BUILD_H
#include "shared/interop.h"

// Digits of the radix sort.
RTSTDB_CONSTANT(radix_bits, 8)
RTSTDB_CONSTANT(radix_digits, 256)

// Upper bound on the levels of a small TLAS: each level of its binary tree resolves one bit of the code (63)
// or of the position (11).
RTSTDB_CONSTANT(max_tlas_levels, 96)
// Number of nodes from which the cost of a TLAS is estimated.
RTSTDB_CONSTANT(max_cost_nodes, 1024)

// Largest number of instances that one workgroup builds alone.
RTSTDB_CONSTANT(small_build_max, 2048)

#define RTSTDB_FIELDS_SortArgs(F)                                          \
  F(uint, count)                                                           \
  F(uint, half_size) /* elements in one half of what is sorted, even */    \
  F(uint, shift)     /* first bit of the digit; sort_keys: 0 for the lower word, 1 for the upper */ \
  F(uint, source)    /* which half is read */                              \
  F(uint, run)       /* keys of one invocation, even; sort_ties, sort_keys: of one workgroup */ \
  F(uvec2, sorted)   /* where that buffer is */                            \
  F(uvec2, counts)   /* and that of the counts */
RTSTDB_STRUCT(SortArgs)

#define RTSTDB_FIELDS_SmallBuildArgs(F) \
  F(uint, count) /* instances with a geometry */ \
  F(uint, half_size)                    \
  F(uint, node_boxes) /* where those of the nodes begin, behind those of the instances */
RTSTDB_STRUCT(SmallBuildArgs)

// For the nodes `first` to `first + count`; tlas_cost: for the first `count` nodes.
#define RTSTDB_FIELDS_RefitArgs(F) \
  F(uint, first)                   \
  F(uint, count)                   \
  F(uint, still) /* tlas_cost: 1: the window is one instant */ \
  F(uint, node_boxes) /* as above */
RTSTDB_STRUCT(RefitArgs)

// Largest number of instances of one patch.
RTSTDB_CONSTANT(max_patched, 512)

#define RTSTDB_FIELDS_PatchArgs(F)                                              \
  F(uint, first)         /* tlas_parents: of the nodes */                       \
  F(uint, count)         /* places listed; tlas_parents: nodes */               \
  F(uint, visible_count) /* places from here on are in no tree */               \
  F(uint, levels)        /* of the tree */                                      \
  F(uint, leaf_parents)  /* where the parents of instances begin */             \
  F(uint, stamp)         /* of this patch: another one each time, never zero */ \
  F(uint, node_boxes)    /* as above */
RTSTDB_STRUCT(PatchArgs)

#endif
