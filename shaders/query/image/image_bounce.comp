#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: ends a bounce of each path after the light of all lights. Adds what the surface emits and
// what it scatters of the skies, as if nothing hid them, unless rays have found that. Lets the path go on in
// the direction of a smooth mirror or through glass, whichever is brighter.
//
// Macro: IMAGE_SHADOW_MAPS: adds the light of lights with shadow maps, which are those of the middle of the
// exposure.
#include "query/image/path_vertex.glsl"
#include "query/image/lobe.glsl"
#ifdef IMAGE_SHADOW_MAPS
layout(set = 0, binding = 16, scalar) readonly buffer MapsBuffer { float maps[]; };
layout(set = 0, binding = 17, scalar) readonly buffer ReachBuffer { uvec2 reach_of_image[]; };
#include "query/image/shadow_map.glsl"

vec3 light_by_maps(PathVertex vertex, uint image) {
  vec3 sum = vec3(0.0);
  for (uint k = args.skies; k < args.mapped_end; ++k) {
    const LightSample found = light_by_map(k, image, vertex.point, vertex.n, vertex.at);
    if (found.light != vec3(0.0)) sum += scattered(vertex.surface, normalize(found.to)).value * found.light;
  }
  return sum;
}
#endif

// A path that would add a smaller share of light sees the sky instead.
const float min_share = 1e-3;

// A direction in which the path may go on, and the share of the light from there that comes back.
struct Continuation {
  vec3 direction;
  vec3 share;
};

Continuation reflection_of(Surface surface, float reflected_by_glass) {
  const vec3 mirror = surface.alpha == 0.0 ? (1.0 - surface.glass) * surface.mirror_share : vec3(0.0);
  return Continuation(reflect(-surface.toward, surface.n), mirror + surface.glass * reflected_by_glass);
}

Continuation refraction_of(Surface surface, float reflected_by_glass) {
  const vec3 direction = refract(-surface.toward, surface.n, surface.index_ratio);
  return Continuation(direction, surface.glass * (1.0 - reflected_by_glass) * surface.clear_color);
}

// Of the skies, what the lobes send along the path that were not searched.
vec3 sky_of_lobes(PathVertex vertex, bool is_first, uint mask) {
  const Surface surface = vertex.surface;
  vec3 sum = vec3(0.0);
  for (uint lobe = 0u; lobe < lobes; ++lobe)
    if (!is_first || !is_searched(surface, lobe))
      sum += share_of_lobe(surface, lobe) * sky_of_lobe(surface, lobe, vertex.at, mask);
  return sum;
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  PathRecord path = path_from(states, args.read_from + place);
  if (fetch_status(shadow_hits, place) == status_miss) path.radiance_cdpm2 += path.shadowed_cdpm2;
  path.shadowed_cdpm2 = vec3(0.0);
  if ((path.flags & path_alive) == 0u) {
    end_path(place, path);
    return;
  }
  const uint image = pixel_of(place).image;
  const uint mask = cameras[image].mask;
  const InputHit hit = fetch_hit(hits, place);
  if (hit.status != status_hit) {
    if (hit.status == status_miss)
      path.radiance_cdpm2 += path.throughput * light_from_afar(normalize(path.direction),
                                                               instant_of(path.t_ns), mask, 0.0, true);
    end_path(place, path);
    return;
  }
  const PathVertex vertex = vertex_of(path, hit);
  path.radiance_cdpm2 += path.throughput * vertex.emission_cdpm2;
  if (path.bounces == args.last_bounce) {
    end_path(place, path);
    return;
  }
  const Surface surface = vertex.surface;
  path.radiance_cdpm2 += path.throughput * sky_of_lobes(vertex, path.bounces == 0u, mask);
#ifdef IMAGE_SHADOW_MAPS
  path.radiance_cdpm2 += path.throughput * light_by_maps(vertex, image);
#endif
  const float reflected_by_glass =
      fresnel_share(clamp(dot(surface.toward, surface.n), 0.0, 1.0), surface.index_ratio);
  const Continuation reflection = reflection_of(surface, reflected_by_glass);
  const Continuation refraction = refraction_of(surface, reflected_by_glass);
  const bool refracts = largest_channel(refraction.share) > largest_channel(reflection.share);
  const Continuation followed = refracts ? refraction : reflection;
  const Continuation ignored = refracts ? reflection : refraction;
  path.radiance_cdpm2 += path.throughput * ignored.share * light_of_sky(ignored.direction, vertex.at, mask);
  path.throughput *= followed.share;
  path.bounces += 1u;
  // Where the normal of the corners differs from that of the triangle, a reflection may lead into it.
  const bool is_blocked =
      dot(followed.direction, surface.n) > 0.0 && dot(followed.direction, vertex.n) <= 0.0;
  const bool goes_on = !is_blocked && largest_channel(path.throughput) >= min_share;
  if (!goes_on) path.radiance_cdpm2 += path.throughput * light_of_sky(followed.direction, vertex.at, mask);
  path.flags = goes_on ? path_alive | path_without_shadow_ray : 0u;
  write_next_ray(place, path, vertex, mask, goes_on, followed.direction);
}
