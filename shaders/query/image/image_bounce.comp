#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: ends a bounce of each path after the light of all lights. Adds what the surface emits and
// what it reflects of the skies, as if nothing hid them, and lets the path go on in the direction of a smooth
// mirror or through glass, whichever is brighter.
#include "query/image/path_vertex.glsl"

// A path that would add a smaller share of light sees the sky instead.
const float min_share = 1e-3;

// What the path would reach in a direction, and the share of it that comes back.
struct Way {
  vec3 direction;
  vec3 share;
};

Way way_of_reflection(Surface surface, float reflected_by_glass) {
  const vec3 mirror = surface.alpha == 0.0 ? (1.0 - surface.glass) * surface.mirror_share : vec3(0.0);
  return Way(reflect(-surface.toward, surface.n), mirror + surface.glass * reflected_by_glass);
}

Way way_through(Surface surface, float reflected_by_glass) {
  const vec3 direction = refract(-surface.toward, surface.n, surface.index_ratio);
  return Way(direction, surface.glass * (1.0 - reflected_by_glass) * surface.clear_color);
}

// Of the skies, what matt and rough parts of a surface send along the path.
vec3 sky_from_rough_parts(Surface surface, Instant at, uint mask) {
  const vec3 matt = surface.retro_cosine < 1.0 ? light_of_sky(surface.toward, at, mask)
                                               : illuminance_of_sky(surface.n, at, mask) / pi;
  const vec3 mirror = light_of_sky(reflect(-surface.toward, surface.n), at, mask);
  const vec3 rough_share = surface.alpha > 0.0 ? surface.mirror_share : vec3(0.0);
  return (1.0 - surface.glass) * (surface.matt_share * matt + rough_share * mirror);
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
  const uint mask = cameras[pixel_of(place).image].mask;
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
  path.radiance_cdpm2 += path.throughput * sky_from_rough_parts(surface, vertex.at, mask);
  const float reflected_by_glass =
      dielectric_share(clamp(dot(surface.toward, surface.n), 0.0, 1.0), surface.index_ratio);
  Way taken = way_of_reflection(surface, reflected_by_glass);
  Way other = way_through(surface, reflected_by_glass);
  if (largest_channel(other.share) > largest_channel(taken.share)) {
    const Way through = other;
    other = taken;
    taken = through;
  }
  path.radiance_cdpm2 += path.throughput * other.share * light_of_sky(other.direction, vertex.at, mask);
  path.throughput *= taken.share;
  path.bounces += 1u;
  // Where the normal of the corners differs from that of the triangle, a reflection may lead into it.
  const bool is_blocked = dot(taken.direction, surface.n) > 0.0 && dot(taken.direction, vertex.n) <= 0.0;
  const bool goes_on = !is_blocked && largest_channel(path.throughput) >= min_share;
  if (!goes_on) path.radiance_cdpm2 += path.throughput * light_of_sky(taken.direction, vertex.at, mask);
  path.flags = goes_on ? path_alive | path_mirrored : 0u;
  write_next_ray(place, path, vertex, mask, goes_on, taken.direction);
}
