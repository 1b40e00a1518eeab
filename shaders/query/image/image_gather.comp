#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: the light that a lobe of the first surface gets along a ray, from what the ray has met or
// from the skies. What it has met counts as matt. The lights with shadow maps light it, and the skies as much
// as the rays of the lobe see of them. What it emits is left out: shadow rays find it.
//
// While a lobe is searched, `shadowed_cdpm2` of the path is the sum of what the skies would add, and `misses`
// is the number of rays that met nothing.
//
// Macro: IMAGE_SHADOW_MAPS: there are lights with shadow maps.
#include "query/image/path_vertex.glsl"
#include "query/image/lobe.glsl"

layout(set = 0, binding = 16) uniform usamplerBuffer lobe_hits;
#ifdef IMAGE_SHADOW_MAPS
layout(set = 0, binding = 17, scalar) readonly buffer MapsBuffer { float maps[]; };
layout(set = 0, binding = 18, scalar) readonly buffer ReachBuffer { uvec2 reach_of_image[]; };
#include "query/image/shadow_map.glsl"
#endif

// The illuminance of a point by the lights with shadow maps.
vec3 illuminance_by_maps(vec3 point, vec3 n, Instant at, uint image) {
  vec3 sum = vec3(0.0);
#ifdef IMAGE_SHADOW_MAPS
  const CameraRecord camera = cameras[image];
  const Instant drawn_at = instant_of(camera.t_ns + camera.exposure_ns / 2u);
  for (uint k = args.skies; k < args.mapped_end; ++k) {
    const LightRecord light = lights[k];
    const LightSample found = middle_of(light, at, point, camera.mask);
    const float cosine = dot(n, normalize(found.to));
    const bool is_lit =
        cosine > 0.0 && found.light != vec3(0.0) && is_lit_by_map(light, image, drawn_at, point, n);
    sum += is_lit ? cosine * found.light : vec3(0.0);
  }
#endif
  return sum;
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  PathRecord path = path_from(states, args.read_from + place);
  const bool begins = args.lobe == 0u && args.ray == 0u;
  if (begins && fetch_status(shadow_hits, place) == status_miss) path.radiance_cdpm2 += path.shadowed_cdpm2;
  if (args.ray == 0u) {
    path.shadowed_cdpm2 = vec3(0.0);
    path.misses = 0u;
  }
  const InputHit hit = fetch_hit(hits, place);
  if ((path.flags & path_alive) != 0u && hit.status == status_hit) {
    const uint image = pixel_of(place).image;
    const uint mask = cameras[image].mask;
    const PathVertex vertex = vertex_of(path, hit);
    const Surface surface = vertex.surface;
    if (is_searched(surface, args.lobe)) {
      const vec3 share = path.throughput * share_of_lobe(surface, args.lobe) / float(args.lobe_rays);
      const vec3 direction = direction_in_lobe(vertex, args.lobe, args.ray);
      const bool is_matt = args.lobe == lobe_matt;
      const bool has_ray = dot(direction, vertex.n) > 0.0;
      const InputHit met = fetch_hit(lobe_hits, place);
      // The whole sky of a matt surface is known, so only what hides it counts.
      if (is_matt && args.ray == 0u)
        path.radiance_cdpm2 +=
            share * float(args.lobe_rays) * sky_of_lobe(surface, lobe_matt, vertex.at, mask);
      const vec3 sky = light_of_sky(direction, vertex.at, mask);
      if (has_ray && met.status == status_hit) {
        const vec3 n = dot(met.n_world, direction) > 0.0 ? -met.n_world : met.n_world;
        const vec3 start = start_of(vertex.point, vertex.n, direction, vertex.size);
        const vec3 color = share * materials[met.material].base_color / pi;
        path.radiance_cdpm2 +=
            color * illuminance_by_maps(start + met.lambda * direction, n, vertex.at, image);
        path.shadowed_cdpm2 += color * illuminance_of_sky(n, vertex.at, mask);
        if (is_matt) path.radiance_cdpm2 -= share * sky;
      } else if (has_ray) {
        path.misses += 1u;
        if (!is_matt) path.radiance_cdpm2 += share * sky;
      }
    }
  }
  if (args.ray + 1u == args.lobe_rays) {
    path.radiance_cdpm2 += path.shadowed_cdpm2 * (float(path.misses) / float(args.lobe_rays));
    path.radiance_cdpm2 = max(path.radiance_cdpm2, vec3(0.0));
    path.shadowed_cdpm2 = vec3(0.0);
    path.misses = 0u;
  }
  paths[args.write_from + place] = path;
}
