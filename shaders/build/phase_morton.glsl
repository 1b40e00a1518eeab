// 63-bit Morton codes of the primitives' centres.
#ifndef RTSTDB_BUILD_PHASE_MORTON_GLSL
#define RTSTDB_BUILD_PHASE_MORTON_GLSL
#include "build/scratch.glsl"
#include "common/morton.glsl"

#endif
