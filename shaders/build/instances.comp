#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Computes the instances of the live entities at the epochs, and their bounds over the window.
#include "common/instance.glsl"
#include "shared/corner.h"
#include "shared/field.h"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { InstanceArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer rows;
layout(set = 0, binding = 1) uniform usamplerBuffer geometries;
layout(set = 0, binding = 2, scalar) readonly buffer LiveBuffer { uint live[]; };
// The instances of the two epochs are bound as separate ranges of one buffer, which may exceed the size of
// one binding.
layout(set = 0, binding = 3, scalar) writeonly buffer InstancesBuffer { vec4 instances[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer LateInstancesBuffer { vec4 late_instances[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer BoundsBuffer { Box bounds[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer MotionBoxesBuffer { MotionBox motion_boxes[]; };
// For windows of one instant: the bounds, still_center_texels each.
layout(set = 0, binding = 7, scalar) writeonly buffer CentersBuffer { vec4 centers[]; };
layout(set = 0, binding = 8, scalar) readonly buffer PlacesBuffer { uint listed_places[]; };
layout(set = 0, binding = 9, scalar) writeonly buffer StillBoundsBuffer { vec4 still_bounds[]; };

const uint no_geometry = 0xFFFFFFFFu;

EntityRecord fetch_row(uint index) {
  const int base = int(index * row_texels);
  const uvec4 t0 = texelFetch(rows, base);
  const uvec4 t2 = texelFetch(rows, base + 2);
  const uvec4 t3 = texelFetch(rows, base + 3);
  const uvec4 t4 = texelFetch(rows, base + 4);
  const uvec4 t5 = texelFetch(rows, base + 5);
  const uvec4 t6 = texelFetch(rows, base + 6);
  const uvec4 t7 = texelFetch(rows, base + 7);
  EntityRecord row;
  row.p_world_m = uintBitsToFloat(t0.xyz);
  row.mask = t0.w;
  row.q_world = uintBitsToFloat(texelFetch(rows, base + 1));
  row.v_world_mps = uintBitsToFloat(t2.xyz);
  row.geometry = t2.w;
  row.w_world_radps = uintBitsToFloat(t3.xyz);
  row.index = t3.w;
  row.scale = uintBitsToFloat(t4.xyz);
  row.material = t4.w;
  row.valid_from = t5.xy;
  row.p_low_m = uintBitsToFloat(uvec3(t5.zw, t6.x));
  row.v_low_mps = uintBitsToFloat(t6.yzw);
  row.w_low_radps = uintBitsToFloat(t7.xyz);
  row.unused = t7.w;
  return row;
}

vec4 geometry_texel(uint index, int texel) {
  return uintBitsToFloat(texelFetch(geometries, int(index * geometry_texels) + texel));
}

GeometryRecord fetch_geometry(uint index) {
  const vec4 t0 = geometry_texel(index, 0);
  const vec4 t1 = geometry_texel(index, 1);
  const uvec4 t7 = floatBitsToUint(geometry_texel(index, 7));
  return GeometryRecord(t0.xyz, floatBitsToUint(t0.w), t1.xyz, floatBitsToUint(t1.w),
                        geometry_texel(index, 2), geometry_texel(index, 3), geometry_texel(index, 4),
                        geometry_texel(index, 5), geometry_texel(index, 6), t7.x, t7.y, t7.z, t7.w);
}

#define WRITE_INSTANCE(target, i)                                                                \
  {                                                                                              \
    const uint base = place * instance_texels;                                                   \
    target[base] = vec4(i.p, uintBitsToFloat(i.mask));                                           \
    target[base + 1u] = i.q;                                                                     \
    target[base + 2u] = vec4(i.v, uintBitsToFloat(i.blas_root));                                 \
    target[base + 3u] = vec4(i.w, uintBitsToFloat(i.entity));                                    \
    target[base + 4u] =                                                                          \
        vec4(i.scale, uintBitsToFloat(uint(i.from_ns) | (i.closed ? instance_closed_bit : 0u))); \
    target[base + 5u] = vec4(i.box_center, uintBitsToFloat(geometry.field));                     \
    target[base + 6u] = vec4(i.box_half, uintBitsToFloat(row.geometry));                         \
  }

Instance written_down(EntityRecord row, GeometryRecord geometry, uvec2 epoch) {
  const int from_ns = from_ns_of(row.valid_from, epoch);
  Instance i = instance_of(row, geometry, from_ns > 0 ? row.valid_from : epoch);
  i.from_ns = from_ns;
  return i;
}

// The position in `live` identifies an instance. Entities without a geometry come after the first
// `visible_count` ones. They have instances, since they may carry queries, but are not in the tree.
void main() {
  if (gl_GlobalInvocationID.x >= args.count) return;
  const uint place =
      args.listed != 0u ? listed_places[gl_GlobalInvocationID.x] : args.first + gl_GlobalInvocationID.x;
  const EntityRecord row = fetch_row(live[place]);
  GeometryRecord geometry =
      GeometryRecord(vec3(0.0), ref_none, vec3(0.0), 0u, vec4(0.0), vec4(0.0), vec4(0.0), vec4(0.0),
                     vec4(0.0), field_none, 0u, attributes_none, 0u);
  if (row.geometry != no_geometry) geometry = fetch_geometry(row.geometry);
  const Instance early = written_down(row, geometry, args.epoch);
  WRITE_INSTANCE(instances, early)
  if (args.meets_late != 0u) {
    const Instance late = written_down(row, geometry, args.late_epoch);
    WRITE_INSTANCE(late_instances, late)
  }
  if (place >= args.visible_count) return;
  // Derived from the epoch's instance, exactly as queries with times of their own do.
  const OrientedBox still = bounds_at(early, int(args.window_begin.x - args.epoch.x));
  if (args.window_s == 0.0) {
    centers[place * still_center_texels] = vec4(still.center, uintBitsToFloat(early.mask));
    centers[place * still_center_texels + 1u] = vec4(
        center_velocity_at(early, int(args.window_begin.x - args.epoch.x)), uintBitsToFloat(early.entity));
    still_bounds[place * still_bounds_texels] = vec4(still.center, uintBitsToFloat(early.mask));
    still_bounds[place * still_bounds_texels + 1u] = vec4(still.half_extent, uintBitsToFloat(early.entity));
    still_bounds[place * still_bounds_texels + 2u] = still.q;
  }
  const MotionBox box =
      bounds_of(instance_of(row, geometry, args.window_begin), extents_of(geometry), args.window_s);
  bounds[place] = swept(box);
  // A window of one instant has the same box at both ends; the second one is replaced by the box around the
  // centre, for searches by centre.
  motion_boxes[place] = MotionBox(box.begin, args.window_s == 0.0 ? Box(still.center, still.center) : box.end,
                                  box.overhang, 0.0);
}
