// Random numbers as a function of pixel, sample and purpose, so that an image does not depend on the order in
// which its pixels are computed. Source: Jarzynski and Olano, "Hash Functions for GPU Rendering", 2020
// (pcg4d).
#ifndef RTSTDB_QUERY_IMAGE_RANDOM_GLSL
#define RTSTDB_QUERY_IMAGE_RANDOM_GLSL

uvec4 mixed_words(uvec4 v) {
  v = v * 1664525u + 1013904223u;
  for (uint turn = 0u; turn < 2u; ++turn) {
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    if (turn == 0u) v ^= v >> 16u;
  }
  return v;
}

// Four numbers in [0, 1).
vec4 random_numbers(uint pixel, uint sample_index, uint purpose, uint seed) {
  return vec4(mixed_words(uvec4(pixel, sample_index, purpose, seed)) >> 8u) * 5.9604644775390625e-8;
}

#endif
