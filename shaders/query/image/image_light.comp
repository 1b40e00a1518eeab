#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: the light of one point of a light at the surface that each path has met, and its shadow
// ray. The light of the point before is added if its shadow ray met nothing.
#include "query/image/path_vertex.glsl"

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
    const LightSample light = point_of_lights(args.light, vertex.at, vertex.point, mask);
    path.shadowed_cdpm2 = light_over_shadow_ray(place, path, vertex, mask, light,
                                                scattered(vertex.surface, normalize(light.to)).value);
  } else {
    write_shadow_ray(place, no_ray(path.origin_m, path.direction, path.t_ns));
  }
  paths[args.write_from + place] = path;
}
