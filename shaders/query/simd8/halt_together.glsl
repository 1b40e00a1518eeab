#ifndef RTSTDB_QUERY_SIMD8_HALT_TOGETHER_GLSL
#define RTSTDB_QUERY_SIMD8_HALT_TOGETHER_GLSL
#include "common/halt.glsl"
#include "query/simd8/lanes.glsl"

// Whether the subgroup halts: lane 0 decides, since each lane may have read another value.
bool subgroup_halts(uvec2 halt) { return of_lane(halt_requested(halt) ? 1u : 0u, 0u) != 0u; }

#endif
