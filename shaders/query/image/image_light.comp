#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: the light of one of the lights without shadow maps at the surface that each path has met,
// and its shadow ray: of the middle of a lamp or a sun, or of one of args.zones_per_emitter zones of a surface.
// The light of the one before is added if its shadow ray met nothing.
#include "query/image/path_vertex.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer ZonesBuffer { EmitterZone zones[]; };
layout(set = 0, binding = 17, scalar) readonly buffer ZonePointsBuffer { EmitterPoint zone_points[]; };
#include "query/image/emitter_zone.glsl"

vec3 light_of_surface(uint place, PathRecord path, PathVertex vertex, uint mask, uint index) {
  const LightRecord light = lights[args.emitters_from + index / args.zones_per_emitter];
  const Instance i = instance_of_entity(light.entity, vertex.at);
  const vec4 q = orientation_of(i, vertex.at.t_ns);
  const vec4 to_entity = conjugate(q);
  const vec3 luminance = (light.mask & mask) == 0u ? vec3(0.0) : light.color;
  const ZoneLight found = light_of_zone(light.first_zone + index % args.zones_per_emitter,
                                        rotate(to_entity, vertex.point - position_of(i, vertex.at.t_ns)),
                                        rotate(to_entity, vertex.surface.n), luminance);
  const vec3 share =
      found.light == vec3(0.0) ? vec3(0.0) : scattered(vertex.surface, rotate(q, found.from)).value;
  const LightSample shadow = LightSample(rotate(q, found.to_shadow), false, found.light, 0.0);
  return light_over_shadow_ray(place, path, vertex, mask, shadow, share);
}

vec3 light_of_middle(uint place, PathRecord path, PathVertex vertex, uint mask, uint index) {
  const LightSample light = middle_of(lights[args.mapped_end + index], vertex.at, vertex.point, mask);
  return light_over_shadow_ray(place, path, vertex, mask, light,
                               scattered(vertex.surface, normalize(light.to)).value);
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  PathRecord path = path_from(states, args.read_from + place);
  if (fetch_status(shadow_hits, place) == status_miss) path.radiance_cdpm2 += path.shadowed_cdpm2;
  path.shadowed_cdpm2 = vec3(0.0);
  const InputHit hit = fetch_hit(hits, place);
  if ((path.flags & path_alive) != 0u && hit.status == status_hit) {
    const uint mask = cameras[pixel_of(place).image].mask;
    const PathVertex vertex = vertex_of(path, hit);
    const uint others = args.emitters_from - args.mapped_end;
    path.shadowed_cdpm2 = args.light < others
                              ? light_of_middle(place, path, vertex, mask, args.light)
                              : light_of_surface(place, path, vertex, mask, args.light - others);
  } else {
    write_shadow_ray(place, no_ray(path.origin_m, path.direction, path.t_ns));
  }
  paths[args.write_from + place] = path;
}
