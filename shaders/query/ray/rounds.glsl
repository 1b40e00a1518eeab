// Limits of loop iterations (rounds, common/loops.glsl) of rays in one dispatch: large enough that few rays
// need a second dispatch, small enough that a dispatch takes about a millisecond at most.
#ifndef RTSTDB_QUERY_RAY_ROUNDS_GLSL
#define RTSTDB_QUERY_RAY_ROUNDS_GLSL
#include "common/loops.glsl"

// Of a subgroup, per eight rays; what eight rays leave unused is available to the next eight. A ray that is
// cut short is retried by itself.
const uint rounds_at_first = 2000u;

// Of a retried ray, which goes on in another dispatch. No lane can count the rounds of others; sixteen lanes
// together stay far below max_rounds.
const uint rounds_at_once = 1000u;

#endif
