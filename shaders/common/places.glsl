#ifndef RTSTDB_COMMON_PLACES_GLSL
#define RTSTDB_COMMON_PLACES_GLSL

// A permutation of 0..count-1 that sends neighbours far apart: the even results first, then the odd ones.
uint interleaved(uint group, uint count) {
  const uint evens = (count + 1u) / 2u;
  return group < evens ? 2u * group : 2u * (group - evens) + 1u;
}

// What this invocation answers: the first `per_group` of a workgroup have a place each, behind those of the group before; the others
// get one that is beyond all ends. See rtstdb/query/spread.hpp.
// Workgroups are handed to lavapipe's threads in contiguous halves; taking them crosswise gives both the same work.
uint place_of_invocation(uint first, uint per_group) {
  const uint place =
      first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * per_group + gl_LocalInvocationID.x;
  return gl_LocalInvocationID.x < per_group ? place : 0xFFFFFFFFu;
}

#endif
