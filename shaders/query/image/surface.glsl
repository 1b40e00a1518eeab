// How a surface scatters light (rtstdb/material.hpp). Directions point away from the surface; `toward` is the
// direction from which the path comes. A value is the share of light per steradian, times the cosine of the
// angle of incidence.
//
// The clear part of a surface (`glass`) reflects and refracts as a dielectric. Its opaque part is a mixture
// of a metal, which is a rough mirror, and a dielectric, which is a rough mirror above a matt base. Each
// share of the mixture scatters light as that kind alone; since both mirrors have the same roughness, their
// reflections are added up in one. A mirror is of GGX microfacets (Walter et al., "Microfacet Models for
// Refraction through Rough Surfaces", 2007), whose missing multiple scattering is made up for by a factor
// (Turquin, "Practical multiple scattering compensation for microfacet models", 2019). The base gets the
// light that the mirror above it does not reflect toward `toward`, so no surface reflects more light than it
// gets.
//
// Sampling of normals: Dupuy and Benyoub, "Sampling Visible GGX Normals with Spherical Caps", 2023; of those
// that reflect out of the surface: Eto and Tokuyoshi, "Bounded VNDF Sampling for Smith-GGX Reflections",
// 2023.
#ifndef RTSTDB_QUERY_IMAGE_SURFACE_GLSL
#define RTSTDB_QUERY_IMAGE_SURFACE_GLSL

const float pi = 3.14159265358979;

// A mirror with less roughness than this reflects in one direction.
const float min_roughness = 0.03;

struct Surface {
  vec3 n;  // on the side of `toward`
  vec3 toward;
  bool from_front;
  float alpha;         // of GGX; 0: a smooth mirror
  vec3 normal_share;   // that the mirrors reflect at normal incidence, see mirror_of
  vec3 grazing_share;  // and at grazing incidence
  vec3 mirror_share;   // the part of uniform light that the mirrors reflect toward the viewer
  vec3 matt_share;     // the part that the base scatters
  float retro_cosine;  // of half the angle of the cone that the base reflects into; 1: it is matt
  vec3 clear_color;
  float glass;
  float index_ratio;         // of the side of `toward` to the other one
  float mirror_probability;  // that the mirror, not the base, is chosen
};

float largest_coordinate(vec3 p) { return max(max(abs(p.x), abs(p.y)), abs(p.z)); }

float largest_channel(vec3 color) { return max(max(color.x, color.y), color.z); }

// The table of shares (shared/image.h), linear between its samples: what a mirror of GGX microfacets reflects
// is normal_share * x + y.
vec2 albedo_terms(float cosine, float roughness) {
  const float last = float(image_albedo_side - 1u);
  const vec2 at = clamp(vec2(cosine, roughness), 0.0, 1.0) * last;
  const vec2 low = min(floor(at), last - 1.0);
  const vec2 part = at - low;
  const int base = int(low.y) * int(image_albedo_side) + int(low.x);
  const vec2 below = mix(texelFetch(albedo, base).xy, texelFetch(albedo, base + 1).xy, part.x);
  const vec2 above = mix(texelFetch(albedo, base + int(image_albedo_side)).xy,
                         texelFetch(albedo, base + int(image_albedo_side) + 1).xy, part.x);
  return mix(below, above, part.y);
}

// Shares of the light that a mirror reflects at normal and at grazing incidence.
struct Mirror {
  vec3 normal_share;
  vec3 grazing_share;
};

// The mirror of a surface that reflects `color` at normal incidence; at grazing incidence it reflects all,
// unless hardly any at normal incidence. Between its microfacets the mirror scatters light more than once; so
// both shares are multiplied by 1 + color * energy_gain (Turquin, 2019; Kulla, Conty, 2017).
Mirror mirror_of(vec3 color, float energy_gain) {
  const vec3 gain = 1.0 + color * energy_gain;
  return Mirror(color * gain, min(50.0 * color, vec3(1.0)) * gain);
}

Surface surface_of(MaterialRecord material, vec3 color, vec3 n, vec3 toward, bool from_front) {
  const float cosine = clamp(dot(n, toward), 1e-4, 1.0);
  const bool is_smooth = material.roughness < min_roughness;
  const float metallic = material.metallic;
  const float index = material.refractive_index;
  const float dielectric = (index - 1.0) * (index - 1.0) / ((index + 1.0) * (index + 1.0));
  const vec2 terms = albedo_terms(cosine, is_smooth ? 0.0 : material.roughness);
  Surface surface;
  surface.n = n;
  surface.toward = toward;
  surface.from_front = from_front;
  surface.alpha = is_smooth ? 0.0 : material.roughness * material.roughness;
  const float energy_gain = 1.0 / max(terms.x + terms.y, 1e-3) - 1.0;
  const Mirror of_metal = mirror_of(color, energy_gain);
  const Mirror of_dielectric = mirror_of(vec3(dielectric), energy_gain);
  surface.glass = material.transmission * (1.0 - metallic);
  const float metal = min(metallic / max(1.0 - surface.glass, 1e-6), 1.0);  // of the opaque part
  surface.normal_share = mix(of_dielectric.normal_share, of_metal.normal_share, metal);
  surface.grazing_share = mix(of_dielectric.grazing_share, of_metal.grazing_share, metal);
  surface.mirror_share = surface.normal_share * terms.x + surface.grazing_share * terms.y;
  const vec3 above_base = of_dielectric.normal_share * terms.x + of_dielectric.grazing_share * terms.y;
  surface.matt_share = color * (1.0 - metal) * max(1.0 - above_base, vec3(0.0));
  surface.retro_cosine = material.retro_gain > 0.0 ? 1.0 - 0.5 / material.retro_gain : 1.0;
  surface.clear_color = color;
  surface.index_ratio = from_front ? 1.0 / index : index;
  const float mirror = largest_channel(surface.mirror_share);
  surface.mirror_probability = mirror / max(mirror + largest_channel(surface.matt_share), 1e-6);
  return surface;
}

// ---- frames

// Two unit vectors across n, by column, and n. Source: Duff et al., "Building an Orthonormal Basis,
// Revisited", 2017.
mat3 axes_around(vec3 n) {
  const float side = n.z >= 0.0 ? 1.0 : -1.0;
  const float a = -1.0 / (side + n.z);
  const float b = n.x * n.y * a;
  return mat3(vec3(1.0 + side * n.x * n.x * a, side * b, -side * n.x), vec3(b, side + n.y * n.y * a, -n.y),
              n);
}

vec3 direction_at(float cosine, float angle) {
  const float sine = sqrt(max(1.0 - cosine * cosine, 0.0));
  return vec3(sine * cos(angle), sine * sin(angle), cosine);
}

// ---- GGX microfacets, in a frame whose z is the normal

float ggx_density(vec3 h, float alpha) {
  const vec2 slope = h.xy / alpha;
  const float across = dot(slope, slope) + h.z * h.z;
  return 1.0 / (pi * alpha * alpha * across * across);
}

float smith_lambda(vec3 direction, float alpha) {
  const float tangent_squared = dot(direction.xy, direction.xy) / max(direction.z * direction.z, 1e-12);
  return 0.5 * (sqrt(1.0 + alpha * alpha * tangent_squared) - 1.0);
}

// Samples a visible microfacet. `reach`: the part of the spherical cap that is sampled; 1: the whole cap.
vec3 microfacet_of_cap(vec3 toward, float alpha, vec2 random, float reach) {
  const vec3 stretched = normalize(vec3(alpha * toward.xy, toward.z));
  const float lowest = reach * stretched.z;
  const float z = (1.0 - random.y) * (1.0 + lowest) - lowest;
  const vec3 h = direction_at(clamp(z, -1.0, 1.0), 2.0 * pi * random.x) + stretched;
  return normalize(vec3(alpha * h.xy, h.z));
}

vec3 visible_microfacet(vec3 toward, float alpha, vec2 random) {
  return microfacet_of_cap(toward, alpha, random, 1.0);
}

// The reach of a small cap that holds all microfacets that reflect `toward` out of the surface.
float reach_of_reflecting(vec3 toward, float alpha) {
  const float s = 1.0 + length(toward.xy);
  const float squares = alpha * alpha / (s * s) * toward.z * toward.z;
  return (1.0 - alpha * alpha) / (1.0 + squares);
}

float schlick_weight(float cosine) {
  const float rest = clamp(1.0 - cosine, 0.0, 1.0);
  return rest * rest * rest * rest * rest;
}

// The share that a smooth dielectric reflects. `index_ratio`: of the side of the light to the other one.
float fresnel_share(float cosine, float index_ratio) {
  const float sine_squared = index_ratio * index_ratio * (1.0 - cosine * cosine);
  if (sine_squared >= 1.0) return 1.0;
  const float inner = sqrt(1.0 - sine_squared);
  const float across = (index_ratio * cosine - inner) / (index_ratio * cosine + inner);
  const float along = (cosine - index_ratio * inner) / (cosine + index_ratio * inner);
  return 0.5 * (across * across + along * along);
}

// ---- values

// Share of the light that the opaque part scatters from `to` toward `toward`, and the probability per
// steradian with which sampled_bounce chooses `to`. A smooth mirror is left out of both.
struct Scattered {
  vec3 value;
  float pdf;
};

Scattered scattered(Surface surface, vec3 to) {
  const mat3 axes = axes_around(surface.n);
  const vec3 i = to * axes;
  const vec3 o = surface.toward * axes;
  Scattered result = Scattered(vec3(0.0), 0.0);
  if (i.z <= 0.0 || o.z <= 0.0) return result;
  const float opaque = 1.0 - surface.glass;
  if (surface.alpha > 0.0) {
    const vec3 h = normalize(i + o);
    const vec3 reflected = mix(surface.normal_share, surface.grazing_share, schlick_weight(dot(o, h)));
    const float facets = ggx_density(h, surface.alpha);
    const float visible = smith_lambda(o, surface.alpha);
    const float both = 1.0 + visible + smith_lambda(i, surface.alpha);
    const float cap = 1.0 + 2.0 * visible + reach_of_reflecting(o, surface.alpha);
    result.value += reflected * (facets / (4.0 * o.z * both));
    result.pdf += surface.mirror_probability * facets / (2.0 * o.z * cap);
  }
  const float base_probability = 1.0 - surface.mirror_probability;
  if (surface.retro_cosine < 1.0) {
    const float per_steradian =
        dot(i, o) >= surface.retro_cosine ? 0.5 / (pi * (1.0 - surface.retro_cosine)) : 0.0;
    result.value += surface.matt_share * per_steradian;
    result.pdf += base_probability * per_steradian;
  } else {
    result.value += surface.matt_share * (i.z / pi);
    result.pdf += base_probability * (i.z / pi);
  }
  result.value *= opaque;
  result.pdf *= opaque;
  return result;
}

// ---- sampling

struct Bounce {
  vec3 direction;
  vec3 weight;  // value over probability; zero: the light is absorbed
  float pdf;    // 0 if mirrored
  bool mirrored;
};

Bounce absorbed() { return Bounce(vec3(0.0), vec3(0.0), 0.0, false); }

// `random`: between 0 and 1; .w decides between reflection and refraction.
Bounce through_glass(Surface surface, mat3 axes, vec4 random) {
  const vec3 o = surface.toward * axes;
  const vec3 up = vec3(0.0, 0.0, 1.0);
  const vec3 h = surface.alpha > 0.0 ? visible_microfacet(o, surface.alpha, random.xy) : up;
  const bool reflects = random.w < fresnel_share(dot(o, h), surface.index_ratio);
  vec3 i = reflects ? reflect(-o, h) : refract(-o, h, surface.index_ratio);
  // A microfacet that would send the light to the wrong side is replaced by the smooth surface.
  if (reflects && i.z <= 0.0) i = reflect(-o, up);
  if (!reflects && i.z >= 0.0) i = refract(-o, up, surface.index_ratio);
  if (dot(i, i) == 0.0) i = reflect(-o, up);
  return Bounce(normalize(axes * i), reflects ? vec3(1.0) : surface.clear_color, 0.0, true);
}

Bounce sampled_bounce(Surface surface, vec4 random) {
  const mat3 axes = axes_around(surface.n);
  const vec3 o = surface.toward * axes;
  if (o.z <= 0.0) return absorbed();
  if (random.z < surface.glass) return through_glass(surface, axes, vec4(random.xy, 0.0, random.w));
  const bool takes_mirror = random.w < surface.mirror_probability;
  if (takes_mirror && surface.alpha == 0.0) {
    return Bounce(normalize(axes * vec3(-o.xy, o.z)), surface.mirror_share / surface.mirror_probability, 0.0,
                  true);
  }
  vec3 i;
  if (takes_mirror) {
    const float reach = reach_of_reflecting(o, surface.alpha);
    i = reflect(-o, microfacet_of_cap(o, surface.alpha, random.xy, reach));
  } else if (surface.retro_cosine < 1.0) {
    i = axes_around(o) * direction_at(mix(surface.retro_cosine, 1.0, random.x), 2.0 * pi * random.y);
  } else {
    i = direction_at(sqrt(random.x), 2.0 * pi * random.y);
  }
  const vec3 to = normalize(axes * i);
  const Scattered found = scattered(surface, to);
  if (found.pdf <= 0.0) return absorbed();
  return Bounce(to, found.value / found.pdf, found.pdf, false);
}

#endif
