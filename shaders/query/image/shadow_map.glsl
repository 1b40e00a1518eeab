// Whether a point of a surface is in the shadow of a light, by its shadow maps. A texel has the depth of the
// first surface at its middle; it is compared with where the plane of the receiving surface is there, so
// that a surface does not shade itself.
//
// Included after the bindings `maps` and `reach_of_image`.
#ifndef RTSTDB_QUERY_IMAGE_SHADOW_MAP_GLSL
#define RTSTDB_QUERY_IMAGE_SHADOW_MAP_GLSL
#include "query/image/shadow_view.glsl"

// Depths differ by this share of the distances for rounding, and by this part of a texel.
const float depth_rounding = 4e-6;
const float texel_part = 0.5;
// The receiving plane is trusted as far as this many texels in depth.
const float plane_texels = 16.0;

const uint no_face = 0xFFFFFFFFu;

// The map of the light that shows a point at `from_light`, relative to the light or, with squares, the
// camera.
uint face_showing(LightRecord light, CameraRecord camera, uvec2 reach, Instant at, vec3 from_light) {
  if (light.maps == shadow_faces) {
    const vec3 size = abs(from_light);
    const uint axis = size.x >= size.y ? (size.x >= size.z ? 0u : 2u) : (size.y >= size.z ? 1u : 2u);
    return 2u * axis + (from_light[axis] < 0.0 ? 1u : 0u);
  }
  if (light.kind != light_directional) return 0u;
  const vec3 there = rotate(conjugate(orientation_of_light(light, at)), from_light);
  // One texel within, so that its middle is in the map.
  const float part = 1.0 - 2.0 / float(args.map_side);
  for (uint k = 0u; k < shadow_squares; ++k)
    if (largest_coordinate(there) < part * half_side_of_square(k, camera, reach)) return k;
  return no_face;
}

// By the maps that were drawn in the middle of the exposure. True also where no map shows the point.
bool is_lit_by_map(LightRecord light, uint image, vec3 point, vec3 n) {
  const CameraRecord camera = cameras[image];
  const Instant at = instant_of(camera.t_ns + camera.exposure_ns / 2u);
  const uvec2 reach = reach_of_image[image];
  const bool parallel = light.kind == light_directional;
  const vec3 origin = parallel ? pose_of(camera, at).p : position_of_light(light, at);
  const vec3 from_light = point - origin;
  const uint face = face_showing(light, camera, reach, at, from_light);
  if (face == no_face) return true;
  const ShadowView view = shadow_view(light, face, camera, reach, at);
  const float depth = dot(view.forward, from_light);
  if (!parallel && depth <= near_lamp_m) return true;
  const float scale =
      view.half_size * (parallel ? 1.0 : depth);  // half the map's side, in metres at the point
  const vec2 across = vec2(dot(view.right, from_light), dot(view.down, from_light)) / scale;
  const float side = float(args.map_side);
  const vec2 texel = floor((0.5 * across + 0.5) * side);
  if (any(lessThan(texel, vec2(0.0))) || any(greaterThanEqual(texel, vec2(side)))) return true;
  const uint map = image * args.maps + light.first_map + face;
  const float stored = maps[(map * args.map_side + uint(texel.y)) * args.map_side + uint(texel.x)];
  if (stored <= 0.0) return true;

  // Where the middle of the texel meets the plane of the surface.
  const float texel_m = 2.0 * scale / side;
  const vec2 middle_at = ((texel + 0.5) / side * 2.0 - 1.0) * view.half_size;
  const vec3 sideways = middle_at.x * view.right + middle_at.y * view.down;
  const vec3 start = parallel ? sideways : vec3(0.0);
  const vec3 along = parallel ? view.forward : view.forward + sideways;
  const float on_plane = dot(n, from_light - start) / dot(n, along);
  const float receiver = clamp(on_plane, depth - plane_texels * texel_m, depth + plane_texels * texel_m);
  const float first = parallel ? (1.0 - 2.0 * stored) * view.half_size : near_lamp_m / stored;
  const float rounding =
      depth_rounding * (largest_coordinate(from_light) + view.half_size + largest_coordinate(origin));
  return first >= receiver - texel_part * texel_m - rounding;
}

// The light of light `index`, which has maps, at a point of a surface; none in its shadow and from behind.
LightSample light_by_map(uint index, uint image, vec3 point, vec3 n, Instant at) {
  const LightRecord light = lights[index];
  LightSample found = middle_of(light, at, point, cameras[image].mask);
  const bool shines = dot(found.to, n) > 0.0 && found.light != vec3(0.0);
  if (!shines || !is_lit_by_map(light, image, point, n)) found.light = vec3(0.0);
  return found;
}

#endif
