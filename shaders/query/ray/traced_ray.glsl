// A ray in the world at its instant, and the fields of a hit that follow from the instance and the triangle.
// Rays and cones use these functions, so a cone without an opening has the answer of a ray, bit for bit.
#ifndef RTSTDB_QUERY_RAY_TRACED_RAY_GLSL
#define RTSTDB_QUERY_RAY_TRACED_RAY_GLSL
#include "common/exact_cross.glsl"
#include "common/instance.glsl"

float largest(vec3 p) { return max(max(abs(p.x), abs(p.y)), abs(p.z)); }

vec3 velocity_at(Instance i, int t_ns, vec3 point) { return i.v + cross(i.w, point - position_of(i, t_ns)); }

// A ray in the world frame. `unit`: the caller's lambda per lambda of this ray.
struct TracedRay {
  vec3 origin;
  vec3 direction;
  float unit;
  vec3 v_origin;
  float lambda_min;
  float lambda_max;
  uint mask;
  int t_ns;
  uint instance_base;
  float share;  // of the window that has passed
};

// Moves a ray from the frame of its carrier into the world.
void carry(Instance carrier, inout TracedRay ray) {
  const vec4 q = orientation_of(carrier, ray.t_ns);
  ray.origin = position_of(carrier, ray.t_ns) + rotate(q, ray.origin);
  ray.direction = rotate(q, ray.direction);
  ray.v_origin = velocity_at(carrier, ray.t_ns, ray.origin);
}

// Scales the direction by a power of two, which is exact, so that no product of the search overflows or
// underflows for any direction. The range is given in the caller's lambda.
void scale_direction(inout TracedRay ray) {
  const uint exponent = floatBitsToUint(largest(ray.direction)) >> 23;
  ray.unit = uintBitsToFloat(254u - exponent << 23);
  ray.direction *= ray.unit;
  ray.lambda_min *= uintBitsToFloat(exponent << 23);
  ray.lambda_max = min(ray.lambda_max * uintBitsToFloat(exponent << 23), 3.4e38);
}

// The unit normal of a triangle of an instance, in the world. Normals rotate with the body and scale
// inversely. Lengths are brought near one first, so that no square underflows.
vec3 world_normal(Instance i, int t_ns, vec3 a, vec3 b, vec3 c) {
  const vec3 across = direction_across(a, b, c);
  const vec3 n = across / largest(across) / i.scale;
  return normalize(rotate(orientation_of(i, t_ns), n / largest(n)));
}

#endif
