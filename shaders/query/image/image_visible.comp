#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Which instances the rasteriser draws for a camera, and where they are in its frame. Place: an instance.
#include "query/image/image.glsl"

layout(set = 0, binding = 4) uniform usamplerBuffer geometries;
layout(set = 0, binding = 5, scalar) writeonly buffer VisibleBuffer { VisibleRecord visible[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer DrawsBuffer { uvec4 draws[]; };

// Whether some point of the box may be on the inner side of a plane through the camera.
bool reaches(vec4 row, vec3 center, vec3 half_extent, float least) {
  return dot(row.xyz, center) + row.w + dot(abs(row.xyz), half_extent) >= least;
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  const CameraRecord camera = cameras[args.image];
  const Instant at = instant_of(camera.t_ns + camera.exposure_ns / 2u);
  const CameraPose pose = pose_of(camera, at);
  const uint index = place + at.instance_base;
  Instance i = fetch_instance(instances, index);
  fetch_instance_box(instances, index, i);
  const vec4 q = orientation_of(i, at.t_ns);
  const vec3 from_camera = position_of(i, at.t_ns) - pose.p;
  const mat3 axes = axes_of(pose.q);
  VisibleRecord record;
  record.forward = vec4(rotate(conjugate(q), axes[0]) * i.scale, dot(axes[0], from_camera));
  record.right =
      vec4(rotate(conjugate(q), -axes[1]) * i.scale, dot(-axes[1], from_camera)) / camera.tan_half_x;
  record.down =
      vec4(rotate(conjugate(q), -axes[2]) * i.scale, dot(-axes[2], from_camera)) / camera.tan_half_y;
  const uint geometry = geometry_of_instance(instances, index);
  const uvec4 of_geometry = texelFetch(geometries, int(geometry * geometry_texels) + 7);
  record.first_triangle = of_geometry.y;
  record.instance = index;
  record.near_m = camera.near_m;
  record.unused = 0u;
  visible[place] = record;
  const bool is_seen = (i.mask & camera.mask) != 0u &&
                       reaches(record.forward, i.box_center, i.box_half, camera.near_m) &&
                       reaches(record.forward - record.right, i.box_center, i.box_half, 0.0) &&
                       reaches(record.forward + record.right, i.box_center, i.box_half, 0.0) &&
                       reaches(record.forward - record.down, i.box_center, i.box_half, 0.0) &&
                       reaches(record.forward + record.down, i.box_center, i.box_half, 0.0);
  draws[place] = uvec4(3u * of_geometry.w, is_seen ? 1u : 0u, 0u, place);
}
