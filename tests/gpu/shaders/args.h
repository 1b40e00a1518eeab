// Push constants of the shaders of these tests.
#ifndef TESTS_GPU_ARGS_H
#define TESTS_GPU_ARGS_H
#include "shaders/shared/interop.h"

#define RTSTDB_FIELDS_AddArgs(F) \
  F(uint, first)                 \
  F(uint, count)                 \
  F(uint, amount)
RTSTDB_STRUCT(AddArgs)

#define RTSTDB_FIELDS_CountArgs(F) F(uint, count)
RTSTDB_STRUCT(CountArgs)

#define RTSTDB_FIELDS_GroupsArgs(F) \
  F(uint, offset_words)             \
  F(uint, groups)
RTSTDB_STRUCT(GroupsArgs)

#endif
