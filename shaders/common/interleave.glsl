#ifndef RTSTDB_COMMON_INTERLEAVE_GLSL
#define RTSTDB_COMMON_INTERLEAVE_GLSL

// A permutation of 0..count-1 that sends neighbours far apart: the even results first, then the odd ones.
uint interleaved(uint group, uint count) {
  const uint evens = (count + 1u) / 2u;
  return group < evens ? 2u * group : 2u * (group - evens) + 1u;
}

#endif
