// Arguments of the structure builder's passes.
#ifndef RTSTDB_SHARED_BUILD_H
#define RTSTDB_SHARED_BUILD_H
#include "shared/interop.h"

// Keys in one tile of the radix sort: 32 invocations, each with a run of 64.
RTSTDB_CONSTANT(radix_bits, 8)
RTSTDB_CONSTANT(radix_bins, 256)
RTSTDB_CONSTANT(radix_group, 32)
RTSTDB_CONSTANT(radix_run, 64)
RTSTDB_CONSTANT(radix_tile, 2048)

// Largest number of instances that one workgroup builds alone.
RTSTDB_CONSTANT(small_build_max, 2048)

// Words of the builder's state buffer: bounds of the primitives' centres as ordered integers, then counts.
RTSTDB_CONSTANT(state_center_min, 0)
RTSTDB_CONSTANT(state_center_max, 3)
RTSTDB_CONSTANT(state_level_count, 6)
RTSTDB_CONSTANT(state_node_count, 7)
RTSTDB_CONSTANT(state_words, 16)

#define RTSTDB_FIELDS_BuildArgs(F)                                                             \
  F(uint, count)         /* primitives */                                                      \
  F(uint, max_leaf)      /* primitives a leaf may hold */                                      \
  F(uint, leaf_bits)     /* or-ed into leaf references */                                      \
  F(uint, leaf_base)     /* first triangle of this geometry */                                 \
  F(uint, node_base)     /* where this structure's root stands in the node pool */             \
  F(uint, shift)         /* radix pass: first bit of the digit */                              \
  F(uint, source)        /* radix pass, collapse level: which half of the ping-pong is read */ \
  F(uint, level_count)   /* collapse: wide nodes of this level */                              \
  F(uint, level_first)   /* collapse: index of the level's first wide node in its structure */ \
  F(uint, scan_count)    /* scan: words */                                                     \
  F(uint, half_size)     /* elements in one half of the ping-pong buffers */
RTSTDB_STRUCT(BuildArgs)

#define RTSTDB_FIELDS_SmallBuildArgs(F) \
  F(uvec2, epoch) /* these six: see InstanceArgs */ \
  F(uvec2, late_epoch)                  \
  F(uvec2, window_begin)                \
  F(float, window_s)                    \
  F(uint, late_base)                    \
  F(uint, count)                        \
  F(uint, visible_count)                \
  F(uint, node_base)                    \
  F(uint, half_size)
RTSTDB_STRUCT(SmallBuildArgs)

#endif
