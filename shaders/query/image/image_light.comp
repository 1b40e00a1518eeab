#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Real-time mode: the light of one of the lights without shadow maps at the surface that each path has met,
// and its shadow ray: of the middle of a lamp or a sun, or of one of args.zones_per_emitter zones of a
// surface. The light of the one before is added if its shadow ray met nothing.
//
// The light of a zone (shared/image.h) is an integral over the zone up to second order, by the means and
// covariances of its positions and normals. A part of a curved zone faces the receiver, and a part of a zone
// that the receiver's plane cuts is above it. Both follow from the assumption that the cosine, or the
// height, is distributed uniformly over the zone, with its mean and its variance.
#include "query/image/path_vertex.glsl"

layout(set = 0, binding = 16, scalar) readonly buffer ZonesBuffer { EmitterZone zones[]; };
layout(set = 0, binding = 17, scalar) readonly buffer ZonePointsBuffer { EmitterPoint zone_points[]; };

// Beyond these the second order is not enough; the zone is too near.
const float max_extent_share = 0.25;  // of half an extent along the view, squared, in the distance squared
const float max_shift = 0.3;          // of the distance

// A symmetric matrix (EmitterZone) times a vector.
vec3 times(vec3 squares, vec3 products, vec3 v) {
  return squares * v + vec3(products.x * v.y + products.z * v.z, products.x * v.x + products.y * v.z,
                            products.z * v.x + products.y * v.y);
}

// Half the width of a uniform distribution with this variance.
float half_width(float variance) { return sqrt(3.0 * max(variance, 0.0)); }

vec3 at_most(vec3 v, float size) {
  const float square = dot(v, v);
  return square > size * size ? v * (size * inversesqrt(square)) : v;
}

struct ZoneLight {
  vec3 from;       // the direction from the receiver, unit
  vec3 light;      // luminance times steradians; no light: zero
  vec3 to_shadow;  // from the receiver to the point of the zone to which its shadow ray leads
  float end_clearance;
};

// The point of the zone that is seen best: it faces the receiver, or is turned away from it if the zone is
// seen from behind, and it is above the receiver's plane.
EmitterPoint seen_point(uint zone_index, vec3 receiver, vec3 n, bool from_front) {
  EmitterPoint best = EmitterPoint(vec3(0.0), n);
  float best_cosine = -2.0;
  for (uint k = 0u; k < points_per_zone; ++k) {
    const EmitterPoint point = zone_points[zone_index * points_per_zone + k];
    const vec3 to = point.p_m - receiver;
    const float per_length = inversesqrt(max(dot(to, to), 1e-24));
    const float facing = (from_front ? -1.0 : 1.0) * dot(point.n, to) * per_length;
    const float cosine = min(facing, dot(n, to) * per_length);
    if (cosine > best_cosine) {
      best_cosine = cosine;
      best = point;
    }
  }
  return best;
}

// `receiver`, `n`: the point and the normal of the other surface, in the axes of the zone, as all results.
// `front_alone`: the back of the surface gives the receiver no light.
ZoneLight light_of_zone(uint zone_index, vec3 receiver, vec3 n, vec3 luminance, bool front_alone) {
  const EmitterZone record = zones[zone_index];
  ZoneLight result = ZoneLight(n, vec3(0.0), n, 0.0);
  // The part above the receiver's plane, and its middle.
  vec3 to = record.center_m - receiver;
  float area = record.area_m2;
  const float height = dot(n, to);
  const float half_height = half_width(dot(n, times(record.extent_squares_m2, record.extent_products_m2, n)));
  const bool is_cut = abs(height) < half_height;
  if (area <= 0.0 || (!is_cut && height <= 0.0)) return result;
  if (is_cut) {
    area *= 0.5 * (height + half_height) / half_height;
    to += n * (0.5 * (height + half_height) - height);
  }
  const float distance_squared = max(dot(to, to), 1e-12);
  const float distance_m = sqrt(distance_squared);
  const vec3 view = -to / distance_m;  // toward the receiver

  // The mean cosine of the part that faces the receiver; if no part does, of the back.
  vec3 drift = times(record.n_extent_squares_m, record.n_extent_products_m, view);
  float cosine = dot(record.n, view) - dot(record.n_extent_squares_m, vec3(1.0)) / distance_m;
  const float half_cosine = half_width(dot(view, times(record.n_squares, record.n_products, view)));
  const bool from_front = cosine > -half_cosine;
  if (!from_front && front_alone) return result;
  if (!from_front) {
    cosine = -cosine;
    drift = -drift;
  }
  const bool is_turned = cosine < half_cosine;  // away from the receiver in part
  const float facing =
      is_turned ? 0.25 * (cosine + half_cosine) * (cosine + half_cosine) / half_cosine : cosine;

  // The light comes more from parts that face the receiver, and from near parts, than from the middle.
  drift *= is_turned ? (2.0 * half_cosine - cosine) / (half_cosine * half_cosine) : 1.0 / max(cosine, 1e-4);
  drift = at_most(drift, max_shift * distance_m);
  const vec3 along = times(record.extent_squares_m2, record.extent_products_m2, view);
  const float variance = dot(along, view);
  const float share = min(3.0 * variance / distance_squared, max_extent_share);
  const float across = dot(record.extent_squares_m2, vec3(1.0)) - variance;
  const vec3 nearer = at_most(along * (4.0 / (distance_m * (1.0 + share / 3.0))), max_shift * distance_m);
  const vec3 from = to + drift + nearer;

  // Means of the distance to the power of -4: along a line, and over a disc across it; and by the drift.
  const float rest = 1.0 - share;
  const float beside = 1.0 - dot(drift, view) / distance_m;
  const float power = (1.0 + share / 3.0) / (rest * rest * rest) / (beside * beside * beside * beside);
  const float steradians = area * facing * power / (distance_squared + 2.0 * across);
  // A zone fills no more than all that the receiver sees.
  result.light = luminance * min(steradians * length(from) / distance_m, pi);
  result.from = normalize(from);
  EmitterPoint seen = zone_points[zone_index * points_per_zone];
  if (is_cut || is_turned) seen = seen_point(zone_index, receiver, n, from_front);
  result.to_shadow = seen.p_m - receiver;
  const float to_shadow_m = max(length(result.to_shadow), 1e-12);
  result.end_clearance = end_clearance_of(to_shadow_m, largest_coordinate(seen.p_m),
                                          abs(dot(seen.n, result.to_shadow)) / to_shadow_m);
  return result;
}

vec3 light_of_surface(uint place, PathRecord path, PathVertex vertex, uint mask, uint index) {
  const LightRecord light = lights[args.emitters_from + index / args.zones_per_emitter];
  Instance i = instance_of_entity(light.entity, vertex.at);
  fetch_instance_box(instances, places[light.entity] + vertex.at.instance_base, i);
  const vec4 q = orientation_of(i, vertex.at.t_ns);
  const vec4 to_entity = conjugate(q);
  const vec3 luminance = (light.mask & mask) == 0u ? vec3(0.0) : light.color;
  precise vec3 from_entity = vertex.start - position_of(i, vertex.at.t_ns);
  const vec3 receiver = rotate(to_entity, from_entity);
  const ZoneLight found =
      light_of_zone(light.first_zone + index % args.zones_per_emitter, receiver,
                    rotate(to_entity, vertex.surface.n), luminance, sees_no_inner_side(i, receiver));
  const vec3 share =
      found.light == vec3(0.0) ? vec3(0.0) : scattered(vertex.surface, rotate(q, found.from)).value;
  const LightSample shadow =
      LightSample(rotate(q, found.to_shadow), false, found.light, 0.0, found.end_clearance);
  return light_over_shadow_ray(place, path, vertex, mask, shadow, share);
}

vec3 light_of_middle(uint place, PathRecord path, PathVertex vertex, uint mask, uint index) {
  const LightSample light = middle_of(lights[args.mapped_end + index], vertex.at, vertex.start, mask);
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
