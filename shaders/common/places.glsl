#ifndef RTSTDB_COMMON_PLACES_GLSL
#define RTSTDB_COMMON_PLACES_GLSL

// A permutation of 0..count-1 that separates neighbours: the even numbers first, then the odd ones.
uint interleaved(uint group, uint count) {
  const uint evens = (count + 1u) / 2u;
  return group < evens ? 2u * group : 2u * (group - evens) + 1u;
}

// The place that this invocation searches. The first `per_group` invocations of a workgroup have consecutive
// places behind those of the previous workgroup; the others get an index beyond every range. See
// rtstdb/query/dispatch_layout.hpp. Lavapipe assigns contiguous halves of the workgroups to its threads, and
// interleaving gives both halves similar work.
uint place_of_invocation(uint first, uint per_group) {
  const uint place =
      first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * per_group + gl_LocalInvocationID.x;
  return gl_LocalInvocationID.x < per_group ? place : 0xFFFFFFFFu;
}

#endif
