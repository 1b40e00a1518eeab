#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// A bounce of each path of the path tracer: adds the light that the ray has found, chooses a light for the
// shadow ray, and the direction in which the path goes on.
#include "query/image/path_vertex.glsl"
#include "query/image/random.glsl"

// From this bounce on a path ends with a probability that grows as its throughput falls.
const uint first_roulette = 3u;

// The light that the surface itself emits toward the path's last point.
vec3 emitted(PathRecord path, InputHit hit, vec3 emission, Instant at) {
  if (emission == vec3(0.0) || (path.flags & path_without_shadow_ray) != 0u) return emission;
  const uint light = emitter_light_of(hit.entity.x);
  if (light == args.lights) return emission;
  const Instance i = instance_of_entity(hit.entity.x, at);
  return emission * weight_of_reflected(light, hit.triangle, i, at.t_ns, path.origin_m,
                                        hit.lambda * path.direction, path.pdf);
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  PathRecord path = path_from(states, args.read_from + place);
  const bool is_lit = fetch_status(shadow_hits, place) == status_miss;
  if (path.bounces > 0u && is_lit) path.radiance_cdpm2 += path.shadowed_cdpm2;
  path.shadowed_cdpm2 = vec3(0.0);
  if ((path.flags & path_alive) == 0u) {
    end_path(place, path);
    return;
  }
  const Pixel pixel = pixel_of(place);
  const CameraRecord camera = cameras[pixel.image];
  const InputHit hit = fetch_hit(hits, place);
  if (hit.status != status_hit) {
    if (hit.status == status_miss)
      path.radiance_cdpm2 +=
          path.throughput * light_from_afar(normalize(path.direction), instant_of(path.t_ns), camera.mask,
                                            path.pdf, (path.flags & path_without_shadow_ray) != 0u);
    end_path(place, path);
    return;
  }
  const PathVertex vertex = vertex_of(path, hit);
  path.radiance_cdpm2 += path.throughput * emitted(path, hit, vertex.emission_cdpm2, vertex.at);
  if (path.bounces == args.last_bounce) {
    end_path(place, path);
    return;
  }

  const vec4 first = random_numbers(pixel.index, args.sample_index, 2u * path.bounces, camera.seed);
  const vec4 second = random_numbers(pixel.index, args.sample_index, 2u * path.bounces + 1u, camera.seed);
  const LightSample light = chosen_light(vertex.at, vertex.start, camera.mask, first);
  const Scattered toward_light = scattered(vertex.surface, normalize(light.to));
  const float share = light.pdf > 0.0 ? light.pdf / (light.pdf + toward_light.pdf) : 1.0;
  path.shadowed_cdpm2 =
      light_over_shadow_ray(place, path, vertex, camera.mask, light, toward_light.value * share);

  const Bounce bounce = sampled_bounce(vertex.surface, second);
  // Where the normal of the corners differs from that of the triangle, a reflection may lead into the
  // triangle.
  const bool is_reflected = dot(bounce.direction, vertex.surface.n) > 0.0;
  const bool is_blocked = is_reflected && dot(bounce.direction, vertex.n) <= 0.0;
  path.throughput *= is_blocked ? vec3(0.0) : bounce.weight;
  path.bounces += 1u;
  const float survival =
      path.bounces < first_roulette ? 1.0 : clamp(largest_channel(path.throughput), 0.05, 1.0);
  const vec4 third = random_numbers(pixel.index, args.sample_index, 0x10000u + path.bounces, camera.seed);
  const bool goes_on = largest_channel(path.throughput) > 0.0 && third.x < survival;
  path.throughput /= survival;
  path.pdf = bounce.pdf;
  path.flags = goes_on ? path_alive | (bounce.mirrored ? path_without_shadow_ray : 0u) : 0u;
  write_next_ray(place, path, vertex, camera.mask, goes_on, bounce.direction);
}
