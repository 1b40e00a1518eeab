#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Which instances the rasteriser draws, and their places in clip coordinates. Place: an instance.
//
// Macro: IMAGE_SHADOW_MAP: for a shadow map instead of a camera.
#include "query/image/image.glsl"

layout(set = 0, binding = 4) uniform usamplerBuffer geometries;
layout(set = 0, binding = 5, scalar) writeonly buffer VisibleBuffer { VisibleRecord visible[]; };
layout(set = 0, binding = 6, scalar) writeonly buffer DrawsBuffer { uvec4 draws[]; };
#ifdef IMAGE_SHADOW_MAP
layout(set = 0, binding = 7, scalar) readonly buffer LightsBuffer { LightRecord lights[]; };
layout(set = 0, binding = 8, scalar) readonly buffer ReachBuffer { uvec2 reach_of_image[]; };
#include "query/image/shadow_view.glsl"
#endif

// What is drawn: a point is seen at dot(right, p), dot(down, p), dot(forward, p), all relative to `p`.
struct View {
  vec3 p;
  vec3 forward;
  vec3 right;  // over what reaches the border of the image: a tangent, or metres of parallel light
  vec3 down;
  float near_m;
  bool parallel;
};

View view_of(CameraRecord camera, Instant at) {
#ifdef IMAGE_SHADOW_MAP
  const ShadowView shadow =
      shadow_view(lights[args.light], args.face, camera, reach_of_image[args.image], at);
  return View(shadow.p, shadow.is_square ? shadow.forward / shadow.half_size : shadow.forward,
              shadow.right / shadow.half_size, shadow.down / shadow.half_size, near_lamp_m, shadow.is_square);
#else
  const CameraPose pose = pose_of(camera, at);
  const mat3 axes = axes_of(pose.q);
  return View(pose.p, axes[0], -axes[1] / camera.tan_half_x, -axes[2] / camera.tan_half_y, camera.near_m,
              false);
#endif
}

// Whether some point of the box may be on the inner side of a plane.
bool reaches(vec4 row, vec3 center, vec3 half_extent, float least) {
  return dot(row.xyz, center) + row.w + dot(abs(row.xyz), half_extent) >= least;
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  const CameraRecord camera = cameras[args.image];
  const Instant at = instant_of(camera.t_ns + camera.exposure_ns / 2u);
  const View view = view_of(camera, at);
  const uint index = place + at.instance_base;
  Instance i = fetch_instance(instances, index);
  fetch_instance_box(instances, index, i);
  const vec4 to_entity = conjugate(orientation_of(i, at.t_ns));
  const vec3 from_view = position_of(i, at.t_ns) - view.p;
  const vec4 forward = vec4(rotate(to_entity, view.forward) * i.scale, dot(view.forward, from_view));
  const vec4 one = vec4(0.0, 0.0, 0.0, 1.0);
  VisibleRecord record;
  record.right = vec4(rotate(to_entity, view.right) * i.scale, dot(view.right, from_view));
  record.down = vec4(rotate(to_entity, view.down) * i.scale, dot(view.down, from_view));
  // Depth falls with the distance: near over distance, or of parallel light from 1 to 0 across the square.
  record.depth = view.parallel ? 0.5 * one - 0.5 * forward : view.near_m * one;
  record.w = view.parallel ? one : forward;
  const uint geometry = geometry_of_instance(instances, index);
  const uvec4 of_geometry = texelFetch(geometries, int(geometry * geometry_texels) + 7);
  record.first_triangle = of_geometry.y;
  record.instance = index;
  visible[place] = record;
  // What is before the near side of a square still has a shadow.
  const bool is_seen = (i.mask & camera.mask) != 0u &&
                       (view.parallel ? reaches(one - forward, i.box_center, i.box_half, 0.0)
                                      : reaches(forward, i.box_center, i.box_half, view.near_m)) &&
                       reaches(record.w - record.right, i.box_center, i.box_half, 0.0) &&
                       reaches(record.w + record.right, i.box_center, i.box_half, 0.0) &&
                       reaches(record.w - record.down, i.box_center, i.box_half, 0.0) &&
                       reaches(record.w + record.down, i.box_center, i.box_half, 0.0);
  draws[place] = uvec4(3u * of_geometry.w, is_seen ? 1u : 0u, 0u, place);
}
