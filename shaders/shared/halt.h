// The words by which the host halts a chunk (shaders/common/halt.glsl).
#ifndef RTSTDB_SHARED_HALT_H
#define RTSTDB_SHARED_HALT_H
#include "shared/interop.h"

// The host reads and writes them while the chunk runs. Elements are numbered from the chunk's first.
#define RTSTDB_FIELDS_HaltWords(F)                                                         \
  F(uint, wanted)          /* not 0: the kernel starts no further elements */ \
  F(uint, first_unstarted) /* the first element that was not started */
RTSTDB_STRUCT(HaltWords)

#endif
