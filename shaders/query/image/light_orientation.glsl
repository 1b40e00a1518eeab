// The orientation of a light (shared/image.h) that is not at a point: of its entity, or of a light at rest.
#ifndef RTSTDB_QUERY_IMAGE_LIGHT_ORIENTATION_GLSL
#define RTSTDB_QUERY_IMAGE_LIGHT_ORIENTATION_GLSL

vec4 orientation_of_light(LightRecord light, Instant at) {
  if (light.entity == no_entity) return light.q;
  return orientation_of(instance_of_entity(light.entity, at), at.t_ns);
}

#endif
