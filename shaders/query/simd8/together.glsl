#ifndef RTSTDB_QUERY_SIMD8_TOGETHER_GLSL
#define RTSTDB_QUERY_SIMD8_TOGETHER_GLSL
#include "query/simd8/lanes.glsl"

// Whether the lanes of a subgroup leave the loops of a search together. Where the address of a store differs
// between lanes, lavapipe stores lane by lane, behind a branch on whether the lane is still in the loop; the
// processor mispredicts this branch whenever a lane enters or leaves. Where all lanes leave together, the
// branch always goes the same way. The device sets this constant from its driver (rtstdb/gpu/pipeline.cpp):
// only where subgroups have eight lanes.
#ifdef RAY_WORK_SHARING
const bool lanes_together = true;
#else
layout(constant_id = 1) const bool lanes_together = false;
#endif

// Whether a loop makes another iteration: while the lane wants one or, with lanes_together, while any lane
// does. The loop's body then leaves the state of lanes that want none as it is. All lanes of the subgroup
// call this.
bool another_round(bool wanted) { return lanes_together ? in_any(wanted ? 1u : 0u) != 0u : wanted; }

#endif
