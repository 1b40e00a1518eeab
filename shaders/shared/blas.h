// Arguments and state of the passes that build the structure of one geometry (shaders/build/blas_*.comp) or
// the tree of a large TLAS (tlas_*.comp).
#ifndef RTSTDB_SHARED_BLAS_H
#define RTSTDB_SHARED_BLAS_H
#include "shared/interop.h"

// Primitives per workgroup in the passes that process each primitive.
RTSTDB_CONSTANT(blas_tile, 1024)
RTSTDB_CONSTANT(blas_run, 16)

// A subtree of at most this many triangles becomes a leaf, whatever its surface. This bounds the number of
// nodes.
RTSTDB_CONSTANT(blas_always_leaf, 3)

// Words of the state buffer, which is zeroed before a build: the box of the centres as ordered integers (the
// low corner complemented), the root of the binary tree, whether the sort left codes unsorted, then one
// record per level of the wide tree. A record begins with the counts of an indirect dispatch.
RTSTDB_CONSTANT(blas_center_min, 0)
RTSTDB_CONSTANT(blas_center_max, 3)
RTSTDB_CONSTANT(blas_root, 6)
RTSTDB_CONSTANT(blas_disorder, 7)
RTSTDB_CONSTANT(blas_levels, 8)
RTSTDB_CONSTANT(blas_level_words, 8)
RTSTDB_CONSTANT(blas_level_groups, 0)
RTSTDB_CONSTANT(blas_level_first, 3)
RTSTDB_CONSTANT(blas_level_count, 4)
// Levels per submission; deeper trees need several.
RTSTDB_CONSTANT(blas_levels_recorded, 12)
RTSTDB_CONSTANT(blas_state_words, 8 + 8 * 13)

#define RTSTDB_FIELDS_BlasArgs(F)                                                       \
  F(uint, count)     /* primitives */                                                   \
  F(uint, leaf_base) /* first triangle of this geometry in the pool */                  \
  F(uint, node_base) /* where its root will stand in the node pool */                   \
  F(uint, level)     /* of the wide tree */                                             \
  F(uint, node_count)                                                                   \
  F(uvec2, target)   /* where the tree, nodes, triangles or their order are written */  \
  F(uint, first)     /* of the tree: its first workgroup */                             \
  F(uint, box_first) /* of a TLAS: where the boxes of instances begin, in words, */     \
  F(uint, box_stride) /* and how far they lie apart */
RTSTDB_STRUCT(BlasArgs)

// Arguments of a refit of the nodes of one level, or of the triangles.
#define RTSTDB_FIELDS_BlasRefitArgs(F)                              \
  F(uint, first)     /* counted from the geometry's first */        \
  F(uint, count)                                                    \
  F(uint, node_base) /* where its root stands in the node pool */
RTSTDB_STRUCT(BlasRefitArgs)

#endif
