#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: the light that a lobe of the first surface gets along a ray, from the surface that the ray
// hits or from the skies. That surface counts as matt. The lights with shadow maps light it, and the skies by
// the part of them that the rays of the lobe see. What it emits is left out: shadow rays find it.
//
// The light of the skies from a matt lobe is known if nothing hides them. It is multiplied by the luminance
// that the rays which meet nothing find, over that which all rays would find. So it is right where nothing is
// in the way, and 0 where all rays meet something.
//
// While a lobe is searched, `shadowed_cdpm2` of the path is the sum of what the skies would add, and `seen`
// is the sum of the luminances (of a mirror's lobe: the number) of the rays that have met nothing.
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

float luminance(vec3 color) { return dot(color, vec3(0.2126, 0.7152, 0.0722)); }

// The illuminance of a point by the lights with shadow maps.
vec3 illuminance_by_maps(vec3 point, vec3 n, Instant at, uint image) {
  vec3 sum = vec3(0.0);
#ifdef IMAGE_SHADOW_MAPS
  for (uint k = args.skies; k < args.mapped_end; ++k) {
    const LightSample found = light_by_map(k, image, point, n, at);
    sum += max(dot(n, normalize(found.to)), 0.0) * found.light;
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
    path.seen = 0.0;
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
      const InputHit there = fetch_hit(lobe_hits, place);
      const vec3 sky = light_of_sky(direction, vertex.at, mask);
      if (has_ray && there.status == status_hit) {
        const vec3 n = dot(there.n_world, direction) > 0.0 ? -there.n_world : there.n_world;
        const vec3 color = share * materials[there.material].base_color / pi;
        path.radiance_cdpm2 +=
            color * illuminance_by_maps(vertex.start + there.lambda * direction, n, vertex.at, image);
        path.shadowed_cdpm2 += color * illuminance_of_sky(n, vertex.at, mask);
      } else if (has_ray && there.status == status_miss) {
        path.seen += is_matt ? luminance(sky) : 1.0;
        if (!is_matt) path.radiance_cdpm2 += share * sky;
      }
      if (args.ray + 1u == args.lobe_rays) {
        float whole = float(args.lobe_rays);
        if (is_matt) {
          whole = 0.0;
          for (uint k = 0u; k < args.lobe_rays; ++k)
            whole += luminance(light_of_sky(direction_in_lobe(vertex, lobe_matt, k), vertex.at, mask));
        }
        const float part = whole > 0.0 ? path.seen / whole : 0.0;
        path.radiance_cdpm2 += path.shadowed_cdpm2 * part;
        if (is_matt)
          path.radiance_cdpm2 +=
              share * float(args.lobe_rays) * sky_of_lobe(surface, lobe_matt, vertex.at, mask) * part;
      }
    }
  }
  if (args.ray + 1u == args.lobe_rays) {
    path.shadowed_cdpm2 = vec3(0.0);
    path.seen = 0.0;
  }
  paths[args.write_from + place] = path;
}
