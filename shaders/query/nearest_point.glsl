// The point of a nearest query at its instant.
#ifndef RTSTDB_QUERY_NEAREST_POINT_GLSL
#define RTSTDB_QUERY_NEAREST_POINT_GLSL
#include "common/instance.glsl"
#include "query/nearest_on_triangle.glsl"
#include "shared/nearest.h"
#include "shared/query.h"

vec3 velocity_at(Instance i, float t_s, vec3 point) { return i.v + cross(i.w, point - (i.p + i.v * t_s)); }

struct Asked {
  vec3 point;
  vec3 v;
};

Asked asked_of(samplerBuffer instances, NearestRecord record) {
  Asked asked = Asked(record.point_m, vec3(0.0));
  if (record.carrier != no_entity) {
    const Instance i = fetch_instance(instances, record.carrier + record.instance_base);
    asked.point = i.p + i.v * record.t_s + rotate(orientation_at(i.q, i.w, record.t_s), record.point_m);
    asked.v = velocity_at(i, record.t_s, asked.point);
  }
  return asked;
}

// A point in the frame of an entity, turned but not stretched: there lengths are the world's, whatever the scale.
vec3 into_frame(Instance i, vec4 q, float t_s, vec3 point) { return rotate(conjugate(q), point - (i.p + i.v * t_s)); }

#endif
