#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// A bounce of each path: adds the light that the ray has found, chooses a light for the shadow ray, and the
// direction in which the path goes on.
#include "query/image/hit_input.glsl"
#include "query/image/image.glsl"
#include "query/image/path_input.glsl"
#include "query/image/random.glsl"
#include "query/image/ray_output.glsl"

layout(set = 0, binding = 4) uniform usamplerBuffer hits;
layout(set = 0, binding = 5) uniform usamplerBuffer shadow_hits;
layout(set = 0, binding = 6, scalar) writeonly buffer RaysBuffer { vec4 rays[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer ShadowRaysBuffer { vec4 shadow_rays[]; };
layout(set = 0, binding = 8, scalar) readonly buffer MaterialsBuffer { MaterialRecord materials[]; };
layout(set = 0, binding = 9, scalar) readonly buffer LightsBuffer { LightRecord lights[]; };
layout(set = 0, binding = 10, scalar) readonly buffer EmittersBuffer { EmitterTriangle emitters[]; };
layout(set = 0, binding = 11) uniform samplerBuffer albedo;
layout(set = 0, binding = 13) uniform usamplerBuffer geometries;
layout(set = 0, binding = 14) uniform usamplerBuffer attributes;
layout(set = 0, binding = 15) uniform samplerBuffer states;
layout(set = 0, binding = 12, scalar) writeonly buffer ActivityBuffer {
  uint some_ray;
  uint some_shadow_ray;
};

#include "common/corner_attributes.glsl"
#include "query/image/surface.glsl"
#include "query/image/lights.glsl"

// From this bounce on a path ends with a probability that grows as its throughput falls.
const uint first_roulette = 3u;

// A ray from a surface starts this part of the coordinates and of the way there off the surface, and a shadow
// ray ends this part of its length before the light.
const float clearance = 1e-5;
const float end_clearance = 1e-4;

vec3 start_of(vec3 point, vec3 n, vec3 to, float size) {
  return point + (dot(to, n) >= 0.0 ? 1.0 : -1.0) * clearance * size * n;
}

void write_ray(uint place, OutputRay ray) {
  for (uint k = 0u; k < 3u; ++k) rays[ray_texels * place + k] = ray_texel(ray, k);
}

void write_shadow_ray(uint place, OutputRay ray) {
  for (uint k = 0u; k < 3u; ++k) shadow_rays[ray_texels * place + k] = ray_texel(ray, k);
}

void end_path(uint place, PathRecord path) {
  path.flags = 0u;
  paths[args.write_from + place] = path;
  const OutputRay none = no_ray(path.origin_m, path.direction, path.t_ns);
  write_ray(place, none);
  write_shadow_ray(place, none);
}

// The light that the surface itself emits toward the path's last point.
vec3 emitted(PathRecord path, InputHit hit, vec3 emission, vec3 point, Instant at) {
  if (emission == vec3(0.0) || (path.flags & path_mirrored) != 0u) return emission;
  const uint light = surface_light_of(hit.entity.x);
  if (light == args.lights) return emission;
  const Instance i = instance_of_entity(hit.entity.x, at);
  return emission * share_of_reflected(light, hit.triangle, i, at.t_ns, path.origin_m, point, path.pdf);
}

// What the corners of the triangle say of the point: a normal in the world on the side of `n`, which is the
// triangle's own, and a colour.
CornerAttributes attributes_at(InputHit hit, Instant at, vec3 n, vec3 toward) {
  const uint index = places[hit.entity.x] + at.instance_base;
  const uint geometry = geometry_of_instance(instances, index);
  const uint first = texelFetch(geometries, int(geometry * geometry_texels) + 7).z;
  CornerAttributes found = corner_attributes(first, hit.triangle, hit.uv.x, hit.uv.y);
  if (found.normal != vec3(0.0)) {
    const Instance i = fetch_instance(instances, index);
    found.normal = normalize(rotate(orientation_of(i, at.t_ns), found.normal / i.scale));
    if (dot(found.normal, n) < 0.0) found.normal = -found.normal;
  }
  // A point that is seen can not be lit from behind the seen side.
  if (dot(found.normal, toward) <= 0.0) found.normal = n;
  return found;
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
  const Instant at = instant_of(path.t_ns);
  const InputHit hit = fetch_hit(hits, place);
  const vec3 direction = normalize(path.direction);
  if (hit.status != status_hit) {
    if (hit.status == status_miss)
      path.radiance_cdpm2 += path.throughput * light_from_afar(direction, at, camera.mask, path.pdf,
                                                               (path.flags & path_mirrored) != 0u);
    end_path(place, path);
    return;
  }
  const MaterialRecord material = materials[hit.material];
  const vec3 way = hit.lambda * path.direction;
  const vec3 point = path.origin_m + way;
  path.radiance_cdpm2 += path.throughput * emitted(path, hit, material.emission_cdpm2, point, at);
  if (path.bounces == args.last_bounce) {
    end_path(place, path);
    return;
  }

  const bool from_front = dot(hit.n_world, direction) <= 0.0;
  const vec3 n = from_front ? hit.n_world : -hit.n_world;
  const CornerAttributes corners = attributes_at(hit, at, n, -direction);
  const Surface surface =
      surface_of(material, material.base_color * corners.color, corners.normal, -direction, from_front);
  const float size = largest_coordinate(point) + largest_coordinate(way);
  const vec4 first = random_numbers(pixel.index, args.sample_index, 2u * path.bounces, camera.seed);
  const vec4 second = random_numbers(pixel.index, args.sample_index, 2u * path.bounces + 1u, camera.seed);

  const LightSample light = chosen_light(at, point, camera.mask, first);
  const float distance = length(light.to);
  const Scattered toward_light = scattered(surface, light.to / distance);
  const float share = light.pdf > 0.0 ? light.pdf / (light.pdf + toward_light.pdf) : 1.0;
  const bool is_in_front = dot(light.to, n) > 0.0;
  path.shadowed_cdpm2 = is_in_front ? path.throughput * toward_light.value * light.light * share : vec3(0.0);
  const bool has_shadow_ray = path.shadowed_cdpm2 != vec3(0.0);
  const vec3 shadow_start = start_of(point, n, light.to, size);
  const vec3 to_light = light.is_infinite ? light.to : light.to + point - shadow_start;
  write_shadow_ray(place, has_shadow_ray ? OutputRay(shadow_start, to_light, 0.0,
                                                     light.is_infinite ? 1e30 : 1.0 - end_clearance,
                                                     path.t_ns, camera.mask)
                                         : no_ray(point, direction, path.t_ns));
  if (has_shadow_ray) some_shadow_ray = 1u;

  const Bounce bounce = sampled_bounce(surface, second);
  // Where the normal of the corners differs from that of the triangle, a reflection may lead into the
  // triangle.
  const bool is_reflected = dot(bounce.direction, surface.n) > 0.0;
  const bool is_blocked = is_reflected && dot(bounce.direction, n) <= 0.0;
  path.throughput *= is_blocked ? vec3(0.0) : bounce.weight;
  path.bounces += 1u;
  const float survival =
      path.bounces < first_roulette ? 1.0 : clamp(largest_channel(path.throughput), 0.05, 1.0);
  const vec4 third = random_numbers(pixel.index, args.sample_index, 0x10000u + path.bounces, camera.seed);
  const bool goes_on = largest_channel(path.throughput) > 0.0 && third.x < survival;
  path.throughput /= survival;
  path.origin_m = goes_on ? start_of(point, n, bounce.direction, size) : point;
  path.direction = goes_on ? bounce.direction : direction;
  path.pdf = bounce.pdf;
  path.flags = goes_on ? path_alive | (bounce.mirrored ? path_mirrored : 0u) : 0u;
  paths[args.write_from + place] = path;
  write_ray(place, goes_on ? OutputRay(path.origin_m, path.direction, 0.0, 1e30, path.t_ns, camera.mask)
                           : no_ray(path.origin_m, path.direction, path.t_ns));
  if (goes_on) some_ray = 1u;
}
