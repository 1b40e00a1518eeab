// The views of shadow maps (shared/image.h), at the middle of an image's exposure.
#ifndef RTSTDB_QUERY_IMAGE_SHADOW_VIEW_GLSL
#define RTSTDB_QUERY_IMAGE_SHADOW_VIEW_GLSL
#include "query/image/light_pose.glsl"

const float near_lamp_m = 1e-3;  // nothing nearer to a lamp has a shadow in a map

struct ShadowView {
  vec3 p;
  vec3 forward;
  vec3 right;
  vec3 down;
  float half_size;  // of a square: metres; else: the tangent of half the angle
  bool is_square;   // parallel light
};

// Half the side of square `k`. `reach`: how far the visible surfaces are (image_reach.comp). The last one
// has all visible surfaces around the camera, the first one is twice as large as the nearest of them is
// far.
float half_side_of_square(uint k, CameraRecord camera, uvec2 reach) {
  const vec2 bits = uintBitsToFloat(reach);
  if (!(bits.y > 0.0 && bits.y <= bits.x)) return 1.0;  // nothing is visible
  const float corner =
      sqrt(1.0 + camera.tan_half_x * camera.tan_half_x + camera.tan_half_y * camera.tan_half_y);
  const float farthest = 1.01 * corner * camera.near_m / bits.y;
  const float nearest = min(2.0 * corner * camera.near_m / bits.x, farthest);
  return nearest * pow(farthest / nearest, float(k) / float(shadow_squares - 1u));
}

ShadowView square_view(LightRecord light, uint face, CameraRecord camera, uvec2 reach, Instant at) {
  const mat3 axes = axes_of(orientation_of_light(light, at));
  return ShadowView(pose_of(camera, at).p, axes[0], -axes[1], -axes[2],
                    half_side_of_square(face, camera, reach), true);
}

// Face 2 * axis looks along that axis of the world, face 2 * axis + 1 against it.
ShadowView cube_view(LightRecord light, uint face, Instant at) {
  const vec3 p = position_of_light(light, at);
  const uint axis = face / 2u;
  vec3 forward = vec3(0.0);
  forward[axis] = face % 2u == 0u ? 1.0 : -1.0;
  vec3 right = vec3(0.0);
  right[(axis + 1u) % 3u] = 1.0;
  return ShadowView(p, forward, right, cross(forward, right), 1.0, false);
}

ShadowView shadow_view(LightRecord light, uint face, CameraRecord camera, uvec2 reach, Instant at) {
  if (light.kind == light_directional) return square_view(light, face, camera, reach, at);
  if (light.maps == shadow_faces) return cube_view(light, face, at);
  const mat3 axes = axes_of(orientation_of_light(light, at));
  const float tangent = sqrt(1.0 - light.cos_outer * light.cos_outer) / light.cos_outer;
  // A little wider, so that its edge is in the map.
  return ShadowView(position_of_light(light, at), axes[0], -axes[1], -axes[2], 1.01 * tangent, false);
}

#endif
