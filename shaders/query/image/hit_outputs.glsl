// Writes the outputs that follow from the first hit of the ray through the middle of a pixel.
#ifndef RTSTDB_QUERY_IMAGE_HIT_OUTPUTS_GLSL
#define RTSTDB_QUERY_IMAGE_HIT_OUTPUTS_GLSL
#include "query/image/camera_ray.glsl"
#include "query/image/hit_input.glsl"

layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer Floats { float values[]; };
layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer Words { uint words[]; };
layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer WordPairs { uvec2 pairs[]; };
layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer Vectors { vec3 vectors[]; };
layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer FloatPairs { vec2 pairs[]; };

bool is_wanted(uvec2 address) { return (address.x | address.y) != 0u; }

// Pixels per second, to the right and down, at which a point of the world moves in the image.
vec2 image_motion(CameraRecord camera, CameraPose pose, vec3 point, vec3 velocity) {
  const vec4 to_camera = conjugate(pose.q);
  const vec3 from_camera = point - pose.p;
  const vec3 at = rotate(to_camera, from_camera);
  const vec3 v = rotate(to_camera, velocity - pose.v - cross(pose.w, from_camera));
  const vec2 per_slope = 0.5 * vec2(args.width, args.height) / vec2(camera.tan_half_x, camera.tan_half_y);
  return -per_slope * (v.yz - at.yz * (v.x / at.x)) / at.x;
}

void write_hit_outputs(Pixel pixel, CameraRecord camera, CameraRay ray, InputHit hit) {
  const bool is_hit = hit.status == status_hit;
  const vec3 n = dot(hit.n_world, ray.direction) > 0.0 ? -hit.n_world : hit.n_world;
  const float infinity = uintBitsToFloat(0x7F800000u);
  if (is_wanted(camera.depth)) Floats(camera.depth).values[pixel.index] = is_hit ? hit.lambda : infinity;
  if (is_wanted(camera.entities))
    WordPairs(camera.entities).pairs[pixel.index] = is_hit ? hit.entity : uvec2(no_entity, 0u);
  if (is_wanted(camera.triangles)) Words(camera.triangles).words[pixel.index] = is_hit ? hit.triangle : 0u;
  if (is_wanted(camera.materials)) Words(camera.materials).words[pixel.index] = is_hit ? hit.material : 0u;
  if (is_wanted(camera.normals)) Vectors(camera.normals).vectors[pixel.index] = is_hit ? n : vec3(0.0);
  if (is_wanted(camera.motion)) {
    const vec3 point = ray.origin + hit.lambda * ray.direction;
    const CameraPose pose = pose_of(camera, instant_of(ray.t_ns));
    FloatPairs(camera.motion).pairs[pixel.index] =
        is_hit ? image_motion(camera, pose, point, hit.v_world) : vec2(0.0);
  }
}

#endif
