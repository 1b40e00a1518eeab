// Writes rays where the ray kernels read them (shared/query.h).
#ifndef RTSTDB_QUERY_IMAGE_RAY_OUTPUT_GLSL
#define RTSTDB_QUERY_IMAGE_RAY_OUTPUT_GLSL
#include "shared/query.h"

struct OutputRay {
  vec3 origin;
  vec3 direction;
  float lambda_min;
  float lambda_max;
  uint t_ns;
  uint mask;
};

// Meets nothing, and its search ends at once.
OutputRay no_ray(vec3 origin, vec3 direction, uint t_ns) {
  return OutputRay(origin, direction, 0.0, 0.0, t_ns, 0u);
}

vec4 ray_texel(OutputRay ray, uint texel) {
  if (texel == 0u) return vec4(ray.origin, ray.direction.x);
  if (texel == 1u) return vec4(ray.direction.yz, ray.lambda_min, ray.lambda_max);
  return uintBitsToFloat(uvec4(ray.t_ns, 0u, ray.mask, no_entity));
}

#endif
