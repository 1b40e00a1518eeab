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

// Where a triangle of an entity is.
struct WorldTriangle {
  vec3 a;
  vec3 b;
  vec3 c;
};

WorldTriangle world_triangle(EmitterTriangle triangle, Instance i, int t_ns) {
  const vec3 p = position_of(i, t_ns);
  const vec4 q = orientation_of(i, t_ns);
  return WorldTriangle(p + rotate(q, triangle.a_m * i.scale), p + rotate(q, triangle.b_m * i.scale),
                       p + rotate(q, triangle.c_m * i.scale));
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

// The probability per steradian with which chosen_light finds a point of a surface that emits light.
float pdf_of_emitter(WorldTriangle at, float share, vec3 from, vec3 point) {
  const vec3 across = cross(at.b - at.a, at.c - at.a);
  const vec3 to = point - from;
  const float twice_area = length(across);
  const float projected = abs(dot(across, to));  // twice the area, times cosine and distance
  if (projected <= 0.0) return 0.0;
  const float distance_squared = dot(to, to);
  return 2.0 * share * distance_squared * sqrt(distance_squared) / (projected * float(chosen_lights()));
}

// The share of the light of a surface that a reflected ray meets; the shadow rays provide the rest.
float weight_of_reflected(uint light_index, uint triangle, Instance i, int t_ns, vec3 from, vec3 point,
                          float pdf) {
  const LightRecord light = lights[light_index];
  const EmitterTriangle at = emitters[light.first_triangle + min(triangle, light.triangles - 1u)];
  const float found = pdf_of_emitter(world_triangle(at, i, t_ns), at.share, from, point);
  return pdf / max(pdf + found, 1e-30);
}

// A point of a light as seen from a point of a surface.
struct LightSample {
  vec3 to;  // from the surface; its length is the distance, or 1 if it is infinite
  bool is_infinite;
  vec3 light;  // luminance over the probability of the direction
  float pdf;   // per steradian; 0: a reflected ray can not find it
};

LightSample no_light() { return LightSample(vec3(0.0, 0.0, 1.0), true, vec3(0.0), 0.0); }

LightSample sun_sample(LightRecord light, Instant at, vec2 random) {
  const vec3 axis = rotate(orientation_of_light(light, at), vec3(-1.0, 0.0, 0.0));
  const float count = float(chosen_lights());
  if (light.cos_outer >= 1.0) return LightSample(axis, true, light.color * count, 0.0);
  const vec3 to = axes_around(axis) * direction_at(mix(light.cos_outer, 1.0, random.x), 2.0 * pi * random.y);
  return LightSample(to, true, light.color * count, 1.0 / (disc_steradians(light.cos_outer) * count));
}

LightSample lamp_sample(LightRecord light, Instant at, vec3 from) {
  const vec3 to = position_of_light(light, at) - from;
  const float distance_squared = max(dot(to, to), 1e-12);
  float falloff = 1.0;
  if (light.kind == light_spot) {
    const vec3 axis = rotate(orientation_of_light(light, at), vec3(1.0, 0.0, 0.0));
    const float cosine = -dot(axis, to) * inversesqrt(distance_squared);
    const float t =
        clamp((cosine - light.cos_outer) / max(light.cos_inner - light.cos_outer, 1e-6), 0.0, 1.0);
    falloff = t * t * (3.0 - 2.0 * t);
  }
  return LightSample(to, false, light.color * (falloff / distance_squared * float(chosen_lights())), 0.0);
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
  const WorldTriangle where = world_triangle(triangle, instance_of_entity(light.entity, at), at.t_ns);
  // Uniform over the triangle.
  const float root = sqrt(random.x);
  const vec3 point = mix(where.a, mix(where.b, where.c, random.y), root);
  const float pdf = pdf_of_emitter(where, triangle.share, from, point);
  if (pdf <= 0.0) return no_light();
  return LightSample(point - from, false, light.color / pdf, pdf);
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
