// How many rounds rays make in one dispatch: so many that few need a second one, and so few that others wait for about a millisecond
// at the most (docs/decisions/0027).
#ifndef RTSTDB_QUERY_RAY_ROUNDS_GLSL
#define RTSTDB_QUERY_RAY_ROUNDS_GLSL
#include "common/loops.glsl"

// A subgroup's for each eight of its rays; what those leave is there for the next eight. Who is cut short is asked again, alone.
const uint rounds_at_first = 2000u;

// Of one that is asked again and goes on in another dispatch. Sixteen lanes, none of which can count what the others use up, come nowhere
// near max_rounds together.
const uint rounds_at_once = 1000u;

#endif
