// The normal and the colour at a point of a triangle, from those of its corners (shaders/shared/corner.h).
//
// Included after the binding `attributes` (texels of uvec4).
#ifndef RTSTDB_COMMON_CORNER_ATTRIBUTES_GLSL
#define RTSTDB_COMMON_CORNER_ATTRIBUTES_GLSL
#include "common/octahedron.glsl"
#include "shared/corner.h"

struct CornerAttributes {
  vec3 normal;  // frame of the entity, unscaled, length 1; zero: the triangle's own normal is to be taken
  vec3 color;   // linear
};

vec3 linear_from_srgb(vec3 encoded) {
  const vec3 straight = encoded / 12.92;
  const vec3 curved = pow((encoded + 0.055) / 1.055, vec3(2.4));
  return mix(curved, straight, lessThanEqual(encoded, vec3(0.04045)));
}

vec3 corner_color_from(uint bits) { return linear_from_srgb(unpackUnorm4x8(bits).rgb); }

// `first`: GeometryRecord::attributes. `triangle`: its number in the mesh. `u`, `v`: the barycentric weights
// of its second and third corner.
CornerAttributes corner_attributes(uint first, uint triangle, float u, float v) {
  if (first == attributes_none) return CornerAttributes(vec3(0.0), vec3(1.0));
  const int base = int(first + triangle * corner_texels);
  const uvec4 t0 = texelFetch(attributes, base);
  const uvec2 t1 = texelFetch(attributes, base + 1).xy;
  const vec3 weights = vec3(1.0 - u - v, u, v);
  CornerAttributes result;
  result.color = weights.x * corner_color_from(t0.w) + weights.y * corner_color_from(t1.x) +
                 weights.z * corner_color_from(t1.y);
  result.normal = vec3(0.0);
  if (t0.x == corner_normal_none) return result;
  const vec3 sum = weights.x * unpacked_direction(t0.x) + weights.y * unpacked_direction(t0.y) +
                   weights.z * unpacked_direction(t0.z);
  const float size = length(sum);
  if (size > 1e-6) result.normal = sum / size;
  return result;
}

#endif
