// The lights of a batch (shared/image.h), at the instant of a path: the light of the sky and of the sun's
// disc along a ray, and the choice of a light for a shadow ray. Light from a disc or from a surface is
// found both by shadow rays and by reflected rays, whose shares are weighted by the balance heuristic
// (Veach, 1997).
#ifndef RTSTDB_QUERY_IMAGE_LIGHTS_GLSL
#define RTSTDB_QUERY_IMAGE_LIGHTS_GLSL
#include "query/image/light_pose.glsl"

float disc_steradians(float cosine) { return 2.0 * pi * (1.0 - cosine); }

uint chosen_lights() { return args.lights - args.skies; }

// The luminance of a sky in a direction of its frame.
vec3 luminance_of_sky(LightRecord sky, float elevation_sine) {
  return elevation_sine >= 0.0 ? mix(sky.horizon, sky.color, elevation_sine) : sky.ground;
}

// Returns the sum of the luminances of all skies.
vec3 light_of_sky(vec3 direction, Instant at, uint mask) {
  vec3 sum = vec3(0.0);
  for (uint k = 0u; k < args.skies; ++k) {
    const LightRecord sky = lights[k];
    if ((sky.mask & mask) == 0u) continue;
    sum += luminance_of_sky(sky, rotate(conjugate(orientation_of_light(sky, at)), direction).z);
  }
  return sum;
}

// The illuminance by all skies of a surface with the normal `n` that sees nothing else. `of_zenith` is the
// integral of the sine of elevation times the cosine to n over the directions above both the horizon and the
// surface.
vec3 illuminance_of_sky(vec3 n, Instant at, uint mask) {
  vec3 sum = vec3(0.0);
  for (uint k = 0u; k < args.skies; ++k) {
    const LightRecord sky = lights[k];
    if ((sky.mask & mask) == 0u) continue;
    const float cosine = clamp(rotate(conjugate(orientation_of_light(sky, at)), n).z, -1.0, 1.0);
    const float of_zenith = 2.0 / 3.0 * ((pi - acos(cosine)) * cosine + sqrt(1.0 - cosine * cosine));
    const float above = 0.5 * pi * (1.0 + cosine);
    sum += sky.color * of_zenith + sky.horizon * (above - of_zenith) + sky.ground * (pi - above);
  }
  return sum;
}

// The light that comes along `direction` from beyond all entities. `pdf`: with which the direction was
// chosen; `mirrored`: shadow rays could not find it.
vec3 light_from_afar(vec3 direction, Instant at, uint mask, float pdf, bool mirrored) {
  vec3 sum = light_of_sky(direction, at, mask);
  for (uint k = args.skies; k < args.suns_end; ++k) {
    const LightRecord light = lights[k];
    if ((light.mask & mask) == 0u) continue;
    const vec3 from = rotate(conjugate(orientation_of_light(light, at)), direction);
    if (light.cos_outer < 1.0 && -from.x > light.cos_outer) {  // a sun without a disc meets no ray
      const float steradians = disc_steradians(light.cos_outer);
      const float found = 1.0 / (steradians * float(chosen_lights()));
      sum += light.color / steradians * (mirrored ? 1.0 : pdf / (pdf + found));
    }
  }
  return sum;
}

// Corners of an emitter's triangle relative to a point, so that their rounding is that of the distance, not
// of world coordinates.
struct RelativeTriangle {
  vec3 a;
  vec3 b;
  vec3 c;
};

RelativeTriangle triangle_from(vec3 from, EmitterTriangle triangle, Instance i, int t_ns) {
  precise vec3 p = position_of(i, t_ns) - from;
  const vec4 q = orientation_of(i, t_ns);
  return RelativeTriangle(p + rotate(q, triangle.a_m * i.scale), p + rotate(q, triangle.b_m * i.scale),
                          p + rotate(q, triangle.c_m * i.scale));
}

// Precision of the end of a shadow ray across the surface: a share of the ray's length plus the end's
// coordinates in the frame of its body.
const float end_precision = 3e-6;

// The share of a shadow ray that is left out before the light: the uncertainty of its end along the ray.
// `reach_m`: the largest coordinate of the end in the frame of its body; `cosine`: of the angle between the
// ray and the normal there.
float end_clearance_of(float distance_m, float reach_m, float cosine) {
  return min(end_precision * (1.0 + reach_m / distance_m) / max(cosine, 1e-6), 0.5);
}

// Whether the inner side of an entity's surface can not light a point: the surface is closed, and the point
// is outside its box. `from_m`: the point relative to the entity's position, in its axes.
bool sees_no_inner_side(Instance i, vec3 from_m) {
  return i.closed && any(greaterThan(abs(from_m - i.box_center * i.scale), i.box_half * i.scale));
}

// The light of the surface of an entity; args.lights: it is none.
uint emitter_light_of(uint entity) {
  uint first = args.emitters_from;
  uint end = args.lights;
  while (first < end) {
    const uint middle = (first + end) / 2u;
    if (lights[middle].entity < entity)
      first = middle + 1u;
    else
      end = middle;
  }
  return first < args.lights && lights[first].entity == entity ? first : args.lights;
}

// The outward normal of the triangle times twice its area.
vec3 outward(RelativeTriangle at) { return cross(at.b - at.a, at.c - at.a); }

// The probability per steradian with which chosen_light chooses the point in direction `to` of a surface
// that emits light. `across`: outward() of its triangle.
float pdf_of_emitter(vec3 across, float share, vec3 to) {
  const float projected = abs(dot(across, to));  // twice the area, times cosine and distance
  if (projected <= 0.0) return 0.0;
  const float distance_squared = dot(to, to);
  return 2.0 * share * distance_squared * sqrt(distance_squared) / (projected * float(chosen_lights()));
}

// The share of the light of a surface that a reflected ray meets; the shadow rays provide the rest.
float weight_of_reflected(uint light_index, uint triangle, Instance i, int t_ns, vec3 from, vec3 to,
                          float pdf) {
  const LightRecord light = lights[light_index];
  const EmitterTriangle at = emitters[light.first_triangle + min(triangle, light.triangles - 1u)];
  const float found = pdf_of_emitter(outward(triangle_from(from, at, i, t_ns)), at.share, to);
  return pdf / max(pdf + found, 1e-30);
}

// A point of a light as seen from a point of a surface.
struct LightSample {
  vec3 to;  // from the surface; its length is the distance, or 1 if it is infinite
  bool is_infinite;
  vec3 light;           // luminance over the probability of the direction
  float pdf;            // per steradian; 0: a reflected ray can not find it
  float end_clearance;  // share of the shadow ray that is left out before the light
};

LightSample no_light() { return LightSample(vec3(0.0, 0.0, 1.0), true, vec3(0.0), 0.0, 0.0); }

LightSample sun_sample(LightRecord light, Instant at, vec2 random) {
  const vec3 axis = rotate(orientation_of_light(light, at), vec3(-1.0, 0.0, 0.0));
  const float count = float(chosen_lights());
  if (light.cos_outer >= 1.0) return LightSample(axis, true, light.color * count, 0.0, 0.0);
  const vec3 to = axes_around(axis) * direction_at(mix(light.cos_outer, 1.0, random.x), 2.0 * pi * random.y);
  return LightSample(to, true, light.color * count, 1.0 / (disc_steradians(light.cos_outer) * count), 0.0);
}

LightSample lamp_sample(LightRecord light, Instant at, vec3 from) {
  const Instance i = instance_of_entity(light.entity, at);
  const vec4 q = orientation_of(i, at.t_ns);
  precise vec3 from_lamp = position_of(i, at.t_ns) - from;
  const vec3 to = from_lamp + rotate(q, light.p_m);
  const float distance_squared = max(dot(to, to), 1e-12);
  float falloff = 1.0;
  if (light.kind == light_spot) {
    const vec3 axis = rotate(q, vec3(1.0, 0.0, 0.0));
    const float cosine = -dot(axis, to) * inversesqrt(distance_squared);
    const float t =
        clamp((cosine - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1e-6), 0.0, 1.0);
    falloff = t * t * (3.0 - 2.0 * t);
  }
  return LightSample(to, false, light.color * (falloff / distance_squared * float(chosen_lights())), 0.0,
                     end_clearance_of(sqrt(distance_squared), largest_coordinate(light.p_m), 1.0));
}

LightSample emitter_sample(LightRecord light, Instant at, vec3 from, vec3 random) {
  // The last triangle of which no more than this share of the area lies before it.
  uint first = light.first_triangle;
  uint end = light.first_triangle + light.triangles;
  while (end - first > 1u) {
    const uint middle = (first + end) / 2u;
    if (emitters[middle].below <= random.z)
      first = middle;
    else
      end = middle;
  }
  const EmitterTriangle triangle = emitters[first];
  Instance i = instance_of_entity(light.entity, at);
  fetch_instance_box(instances, places[light.entity] + at.instance_base, i);
  const RelativeTriangle seen = triangle_from(from, triangle, i, at.t_ns);
  // Uniform over the triangle.
  const float root = sqrt(random.x);
  const vec3 to = mix(seen.a, mix(seen.b, seen.c, random.y), root);
  const vec3 across = outward(seen);
  const float pdf = pdf_of_emitter(across, triangle.share, to);
  if (pdf <= 0.0) return no_light();
  precise vec3 from_entity = from - position_of(i, at.t_ns);
  const bool is_inner = dot(across, to) > 0.0;
  if (is_inner && sees_no_inner_side(i, rotate(conjugate(orientation_of(i, at.t_ns)), from_entity)))
    return no_light();
  const float distance_m = length(to);
  const float cosine = abs(dot(across, to)) / (length(across) * distance_m);
  const float reach_m = largest_coordinate(to + from_entity);
  return LightSample(to, false, light.color / pdf, pdf, end_clearance_of(distance_m, reach_m, cosine));
}

// A point of a light. `random`: which one.
LightSample sample_of(LightRecord light, Instant at, vec3 from, uint mask, vec3 random) {
  if ((light.mask & mask) == 0u) return no_light();
  if (light.kind == light_emitter) return emitter_sample(light, at, from, random);
  if (light.kind == light_directional) return sun_sample(light, at, random.xy);
  return lamp_sample(light, at, from);
}

// A point of one of the lights but the skies, each of which is chosen with the same probability.
LightSample chosen_light(Instant at, vec3 from, uint mask, vec4 random) {
  const uint count = chosen_lights();
  if (count == 0u) return no_light();
  const float scaled = random.w * float(count);
  const uint chosen = min(uint(scaled), count - 1u);
  return sample_of(lights[args.skies + chosen], at, from, mask, random.xyz);
}

// The middle of a light, not of a surface.
LightSample middle_of(LightRecord light, Instant at, vec3 from, uint mask) {
  const vec3 in_middle = vec3(1.0, 0.0, 0.0);  // of a sun's disc
  LightSample found = sample_of(light, at, from, mask, in_middle);
  found.light /= float(chosen_lights());
  return found;
}

#endif
