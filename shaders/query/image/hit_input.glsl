// Hits as the ray kernels write them (shared/query.h).
#ifndef RTSTDB_QUERY_IMAGE_HIT_INPUT_GLSL
#define RTSTDB_QUERY_IMAGE_HIT_INPUT_GLSL
#include "shared/query.h"

struct InputHit {
  uint status;
  float lambda;
  vec2 uv;
  uvec2 entity;  // index, generation
  uint material;
  uint triangle;
  bool front;
  vec3 n_world;  // of the front
  vec3 v_world;  // of the point: rays of images have no carrier
};

InputHit hit_from(uvec2 p[hit_pairs]) {
  InputHit hit;
  hit.status = p[0].x;
  hit.lambda = uintBitsToFloat(p[0].y);
  hit.uv = uintBitsToFloat(p[1]);
  hit.entity = p[2];
  hit.material = p[3].y;
  hit.triangle = p[4].x;
  hit.front = p[4].y != 0u;
  hit.n_world = uintBitsToFloat(uvec3(p[5], p[6].x));
  hit.v_world = uintBitsToFloat(uvec3(p[6].y, p[7]));
  return hit;
}

void pairs_of(InputHit hit, out uvec2 p[hit_pairs]) {
  p[0] = uvec2(hit.status, floatBitsToUint(hit.lambda));
  p[1] = floatBitsToUint(hit.uv);
  p[2] = hit.entity;
  p[3] = uvec2(0u, hit.material);
  p[4] = uvec2(hit.triangle, hit.front ? 1u : 0u);
  p[5] = floatBitsToUint(hit.n_world.xy);
  p[6] = floatBitsToUint(vec2(hit.n_world.z, hit.v_world.x));
  p[7] = floatBitsToUint(hit.v_world.yz);
}

InputHit fetch_hit(usamplerBuffer hits, uint place) {
  uvec2 pairs[hit_pairs];
  for (uint k = 0u; k < hit_pairs; k += 2u) {
    const uvec4 texel = texelFetch(hits, int((hit_pairs * place + k) / 2u));
    pairs[k] = texel.xy;
    pairs[k + 1u] = texel.zw;
  }
  return hit_from(pairs);
}

// Returns the status of a search for any hit.
uint fetch_status(usamplerBuffer hits, uint place) { return texelFetch(hits, int(hit_pairs * place / 2u)).x; }

#endif
