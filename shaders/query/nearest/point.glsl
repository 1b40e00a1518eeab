// The point of a nearest query at its instant.
#ifndef RTSTDB_QUERY_NEAREST_POINT_GLSL
#define RTSTDB_QUERY_NEAREST_POINT_GLSL
#include "common/instance.glsl"
#include "query/nearest_on_triangle.glsl"
#include "shared/nearest.h"
#include "shared/query.h"

vec3 velocity_at(Instance i, int t_ns, vec3 point) { return i.v + cross(i.w, point - position_of(i, t_ns)); }

struct QueryPoint {
  vec3 point;
  vec3 v;
};

QueryPoint query_point_of(samplerBuffer instances, NearestRecord record) {
  QueryPoint query = QueryPoint(record.point_m, vec3(0.0));
  if (record.carrier != no_entity) {
    const Instance i = fetch_instance(instances, record.carrier + record.instance_base);
    query.point = position_of(i, record.t_ns) + rotate(orientation_of(i, record.t_ns), record.point_m);
    query.v = velocity_at(i, record.t_ns, query.point);
  }
  return query;
}

// A point in the frame of an entity, rotated but not scaled, so that lengths are those of the world.
vec3 into_frame(Instance i, vec4 q, int t_ns, vec3 point) {
  return rotate(conjugate(q), point - position_of(i, t_ns));
}

#endif
