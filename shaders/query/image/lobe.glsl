// Where the light comes from that a rough surface scatters along the path: the lobe of its matt base,
// around the normal, and that of its rough mirror, around the reflection. Each is searched with rays in
// fixed directions, which share its light equally.
//
// Included after path_vertex.glsl.
#ifndef RTSTDB_QUERY_IMAGE_LOBE_GLSL
#define RTSTDB_QUERY_IMAGE_LOBE_GLSL

// A lobe with a smaller share of the light is not searched.
const float min_lobe_share = 1e-3;

// The share of the light from a lobe that the surface sends along the path.
vec3 share_of_lobe(Surface surface, uint lobe) {
  return (1.0 - surface.glass) * (lobe == lobe_matt ? surface.matt_share : surface.mirror_share);
}

bool is_searched(Surface surface, uint lobe) {
  const bool is_rough = lobe == lobe_matt ? surface.retro_cosine == 1.0 : surface.alpha > 0.0;
  return args.lobe_rays > 0u && is_rough && largest_channel(share_of_lobe(surface, lobe)) >= min_lobe_share;
}

// Spread evenly over the lobe (additive recurrence with powers of the root of x^3 = x + 1). A direction
// into the surface is mirrored out of it.
vec3 direction_in_lobe(PathVertex vertex, uint lobe, uint ray) {
  const Surface surface = vertex.surface;
  const vec2 at = fract(0.5 + float(ray) * vec2(0.7548776662, 0.5698402910));
  const mat3 axes = axes_around(surface.n);
  const vec3 o = surface.toward * axes;
  const vec3 there = lobe == lobe_matt ? direction_at(sqrt(1.0 - at.x), 2.0 * pi * at.y)
                                       : reflect(-o, visible_microfacet(o, surface.alpha, at));
  const vec3 direction = normalize(axes * there);
  return direction - 2.0 * min(dot(direction, vertex.n), 0.0) * vertex.n;
}

// The light of the skies from a lobe, if nothing hides it.
vec3 sky_of_lobe(Surface surface, uint lobe, Instant at, uint mask) {
  if (lobe == lobe_mirror)
    return surface.alpha > 0.0 ? light_of_sky(reflect(-surface.toward, surface.n), at, mask) : vec3(0.0);
  return surface.retro_cosine < 1.0 ? light_of_sky(surface.toward, at, mask)
                                    : illuminance_of_sky(surface.n, at, mask) / pi;
}

#endif
