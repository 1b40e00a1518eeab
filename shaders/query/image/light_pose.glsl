// Where a light (shared/image.h) is, and its orientation: by its entity, or of a light at rest.
#ifndef RTSTDB_QUERY_IMAGE_LIGHT_POSE_GLSL
#define RTSTDB_QUERY_IMAGE_LIGHT_POSE_GLSL

vec4 orientation_of_light(LightRecord light, Instant at) {
  if (light.entity == no_entity) return light.q;
  return orientation_of(instance_of_entity(light.entity, at), at.t_ns);
}

// Of a light at a point.
vec3 position_of_light(LightRecord light, Instant at) {
  const Instance i = instance_of_entity(light.entity, at);
  return position_of(i, at.t_ns) + rotate(orientation_of(i, at.t_ns), light.p_m);
}

#endif
