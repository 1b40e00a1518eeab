#ifndef RTSTDB_QUERY_SIMD8_TOGETHER_GLSL
#define RTSTDB_QUERY_SIMD8_TOGETHER_GLSL
#include "query/simd8/lanes.glsl"

// Whether a search's loops end for all lanes of a subgroup at once. Lavapipe stores to a place that differs from lane to lane behind
// a branch for each lane, which asks whether that lane is still in the loop, and the processor guesses wrong at each that comes or
// goes. Where none goes before the others, each such branch is always taken the same state. The device sets this constant
// from its driver (rtstdb/gpu/pipeline.cpp): only where subgroups have eight lanes.
#ifdef RAY_WORK_SHARING
const bool lanes_together = true;
#else
layout(constant_id = 1) const bool lanes_together = false;
#endif

// Whether a loop makes another round: as long as the lane wants one, or any lane does. Then a lane that wants none runs along, and
// what the loop's body changes it chooses by what it wants. All lanes of the subgroup have to come by.
bool another_round(bool wanted) { return lanes_together ? in_any(wanted ? 1u : 0u) != 0u : wanted; }

#endif
