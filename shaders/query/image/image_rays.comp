#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Begins a sample of each pixel: the ray from the camera.
//
// Macros: IMAGE_CENTER: the ray through the middle of pixel and exposure, which has no state of a path.
//         IMAGE_REAL_TIME: no random numbers.
#include "query/image/camera_ray.glsl"
#include "query/image/random.glsl"
#include "query/image/ray_output.glsl"

layout(set = 0, binding = 4, scalar) writeonly buffer RaysBuffer { vec4 rays[]; };

// Where in the pixel and in the exposure a sample lies: the samples of a pixel are spread evenly
// (additive recurrence with powers of the root of x^4 = x + 1), from a random offset or, in real-time mode,
// from the middle.
vec3 offset_of(Pixel pixel, uint seed) {
#ifdef IMAGE_CENTER
  return middle;
#else
#ifdef IMAGE_REAL_TIME
  const vec3 first = middle;
#else
  const vec3 first = random_numbers(pixel.index, 0u, 0xFFFFFFFFu, seed).xyz;
#endif
  return fract(first + float(args.sample_index) * vec3(0.8191725134, 0.6710436067, 0.5497004779));
#endif
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  const Pixel pixel = pixel_of(place);
  const CameraRecord camera = cameras[pixel.image];
  const CameraRay ray = camera_ray(pixel, camera, offset_of(pixel, camera.seed));
#ifndef IMAGE_CENTER
  PathRecord path;
  path.origin_m = ray.origin;
  path.t_ns = ray.t_ns;
  path.direction = ray.direction;
  path.pdf = 0.0;
  path.throughput = vec3(1.0);
  path.flags = pixel.is_inside ? path_alive | path_without_shadow_ray : 0u;
  path.radiance_cdpm2 = vec3(0.0);
  path.bounces = 0u;
  path.shadowed_cdpm2 = vec3(0.0);
  path.seen = 0.0;
  const bool continues = args.sample_index != 0u;
  path.sum_cdpm2 = continues ? paths[args.read_from + place].sum_cdpm2 : vec3(0.0);
  path.unused = 0u;
  paths[args.write_from + place] = path;
#endif
  const OutputRay made =
      pixel.is_inside ? OutputRay(ray.origin, ray.direction, camera.near_m, 1e30, ray.t_ns, camera.mask)
                      : no_ray(ray.origin, ray.direction, ray.t_ns);
  for (uint k = 0u; k < 3u; ++k) rays[ray_texels * place + k] = ray_texel(made, k);
}
