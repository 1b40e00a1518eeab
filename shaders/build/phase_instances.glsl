// Instances of the live entities at the epochs, and what each covers during the window.
#ifndef RTSTDB_BUILD_PHASE_INSTANCES_GLSL
#define RTSTDB_BUILD_PHASE_INSTANCES_GLSL
#include "build/scratch.glsl"
#include "common/instance.glsl"

layout(set = 0, binding = 11, scalar) readonly buffer RowsBuffer { EntityRecord rows[]; };
layout(set = 0, binding = 12, scalar) readonly buffer GeometriesBuffer { GeometryRecord geometries[]; };
layout(set = 0, binding = 13, scalar) readonly buffer LiveBuffer { uint live[]; };
layout(set = 0, binding = 14, scalar) writeonly buffer InstancesBuffer { vec4 instances[]; };

const uint no_geometry = 0xFFFFFFFFu;

void write_instance(uint place, Instance i) {
  const uint base = place * instance_texels;
  instances[base] = vec4(i.p, uintBitsToFloat(i.mask));
  instances[base + 1u] = i.q;
  instances[base + 2u] = vec4(i.v, uintBitsToFloat(i.blas_root));
  instances[base + 3u] = vec4(i.w, uintBitsToFloat(i.entity));
  instances[base + 4u] = vec4(i.scale, i.closed ? 1.0 : 0.0);
  instances[base + 5u] = vec4(i.box_center, 0.0);
  instances[base + 6u] = vec4(i.box_half, 0.0);
}

// An instance is known by its place in `live`. Entities without a geometry come after the `visible_count` others: they get
// instances (they may carry queries) but no place in the tree. Gives the box that the entity stays in.
Box write_instances(uint place, InstanceArgs times) {
  const EntityRecord row = rows[live[place]];
  GeometryRecord geometry = GeometryRecord(vec3(0.0), ref_none, vec3(0.0), 0u);
  if (row.geometry != no_geometry) geometry = geometries[row.geometry];
  write_instance(place, instance_of(row, geometry, times.epoch));
  if (times.late_base != 0u) write_instance(times.late_base + place, instance_of(row, geometry, times.late_epoch));
  return bounds_of(instance_of(row, geometry, times.window_begin), times.window_s);
}

#endif
