// Reads the state of a path through texels, which is faster than a load of the struct on lavapipe.
#ifndef RTSTDB_QUERY_IMAGE_PATH_INPUT_GLSL
#define RTSTDB_QUERY_IMAGE_PATH_INPUT_GLSL
#include "shared/image.h"

PathRecord path_from(samplerBuffer states, uint place) {
  const int base = int(place * path_texels);
  const vec4 t0 = texelFetch(states, base);
  const vec4 t1 = texelFetch(states, base + 1);
  const vec4 t2 = texelFetch(states, base + 2);
  const vec4 t3 = texelFetch(states, base + 3);
  const vec4 t4 = texelFetch(states, base + 4);
  return PathRecord(t0.xyz, floatBitsToUint(t0.w), t1.xyz, t1.w, t2.xyz, floatBitsToUint(t2.w), t3.xyz,
                    floatBitsToUint(t3.w), t4.xyz, t4.w, texelFetch(states, base + 5).xyz, 0u);
}

#endif
