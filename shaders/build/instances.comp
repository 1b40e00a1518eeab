#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Instances of the live entities at the epochs, and what each covers during the window.
#include "common/instance.glsl"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { InstanceArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer RowsBuffer { EntityRecord rows[]; };
layout(set = 0, binding = 1, scalar) readonly buffer GeometriesBuffer { GeometryRecord geometries[]; };
layout(set = 0, binding = 2, scalar) readonly buffer LiveBuffer { uint live[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer InstancesBuffer { vec4 instances[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer BoundsBuffer { Box bounds[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer MotionBoxesBuffer { MotionBox motion_boxes[]; };

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
// instances (they may carry queries) but no place in the tree.
void main() {
  const uint place = gl_GlobalInvocationID.x;
  if (place >= args.count) return;
  const EntityRecord row = rows[live[place]];
  GeometryRecord geometry = GeometryRecord(vec3(0.0), ref_none, vec3(0.0), 0u);
  if (row.geometry != no_geometry) geometry = geometries[row.geometry];
  write_instance(place, instance_of(row, geometry, args.epoch));
  if (args.late_base != 0u) write_instance(args.late_base + place, instance_of(row, geometry, args.late_epoch));
  if (place >= args.visible_count) return;
  const MotionBox box = bounds_of(instance_of(row, geometry, args.window_begin), args.window_s);
  motion_boxes[place] = box;
  bounds[place] = swept(box);
}
