#ifndef RTSTDB_COMMON_PLACES_GLSL
#define RTSTDB_COMMON_PLACES_GLSL

// A permutation of 0..count-1 that separates neighbours: the even results first, then the odd ones.
uint interleaved(uint group, uint count) {
  const uint evens = (count + 1u) / 2u;
  return group < evens ? 2u * group : 2u * (group - evens) + 1u;
}

// The place that this invocation searches: the first `per_group` invocations of a workgroup have one each, after those of the
// group before; the others get a place beyond every end. See rtstdb/query/dispatch_layout.hpp.
// Lavapipe gives each of its threads a contiguous part of the workgroups; interleaving them balances the work.
uint place_of_invocation(uint first, uint per_group) {
  const uint place =
      first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * per_group + gl_LocalInvocationID.x;
  return gl_LocalInvocationID.x < per_group ? place : 0xFFFFFFFFu;
}

#endif
