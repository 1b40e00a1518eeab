#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: a ray from the first surface of each path into a lobe of it.
#include "query/image/path_vertex.glsl"
#include "query/image/lobe.glsl"

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  const PathRecord path = path_from(states, args.read_from + place);
  const InputHit hit = fetch_hit(hits, place);
  OutputRay ray = no_ray(path.origin_m, path.direction, path.t_ns);
  if ((path.flags & path_alive) != 0u && hit.status == status_hit) {
    const PathVertex vertex = vertex_of(path, hit);
    const vec3 direction = direction_in_lobe(vertex, args.lobe, args.ray);
    if (is_searched(vertex.surface, args.lobe) && dot(direction, vertex.n) > 0.0) {
      ray = OutputRay(vertex.start, direction, 0.0, 1e30, path.t_ns, cameras[pixel_of(place).image].mask);
      some_ray = 1u;
    }
  }
  write_ray(place, ray);
}
