// The poses of regions and of entity bounds at an instant.
#ifndef RTSTDB_QUERY_REGION_REGION_SHAPE_GLSL
#define RTSTDB_QUERY_REGION_REGION_SHAPE_GLSL
#include "common/instance.glsl"
#include "shared/query.h"

// The region's centre and orientation in the world.
OrientedBox posed(samplerBuffer instances, RegionRecord record) {
  OrientedBox box = OrientedBox(record.center_m, record.q, record.half_extent_m);
  if (record.carrier != no_entity) {
    const Instance i = fetch_instance(instances, record.carrier + record.instance_base);
    const vec4 q = orientation_of(i, record.t_ns);
    box.center = position_of(i, record.t_ns) + rotate(q, record.center_m);
    box.q = normalize(quat_product(q, record.q));
  }
  return box;
}

// Bits of a node's children: `meeting`, all that meet the region and perhaps others; `within`, some that lie
// in it.
struct ChildMasks {
  uint meeting;
  uint within;
};

#endif
