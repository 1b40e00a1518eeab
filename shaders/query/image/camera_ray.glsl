// The ray from a camera through a point of a pixel.
#ifndef RTSTDB_QUERY_IMAGE_CAMERA_RAY_GLSL
#define RTSTDB_QUERY_IMAGE_CAMERA_RAY_GLSL
#include "query/image/image.glsl"

struct CameraRay {
  vec3 origin;
  vec3 direction;  // its part along the view direction is 1, so lambda is the depth
  uint t_ns;       // low word
};

// `offset`: where in the pixel and in the exposure, 0 to 1 each.
CameraRay camera_ray(Pixel pixel, CameraRecord camera, vec3 offset) {
  CameraRay ray;
  ray.t_ns = camera.t_ns + (pixel.is_inside ? pixel.row : 0u) * camera.row_ns +
             uint(offset.z * float(camera.exposure_ns));
  const CameraPose pose = pose_of(camera, instant_of(ray.t_ns));
  const vec2 at = 2.0 * (vec2(pixel.column, pixel.row) + offset.xy) / vec2(args.width, args.height) - 1.0;
  ray.origin = pose.p;
  ray.direction = rotate(pose.q, vec3(1.0, -at.x * camera.tan_half_x, -at.y * camera.tan_half_y));
  return ray;
}

const vec3 middle = vec3(0.5);

#endif
