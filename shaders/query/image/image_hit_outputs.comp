#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Writes the outputs that follow from the first hit of the ray through the middle of a pixel, from the hits
// of a search.
//
// Macros: IMAGE_LISTED: of the listed places alone.
#include "query/image/hit_outputs.glsl"

layout(set = 0, binding = 4) uniform usamplerBuffer hits;
#ifdef IMAGE_LISTED
layout(set = 0, binding = 5, scalar) readonly buffer ListBuffer { uint listed[]; };
#endif

void main() {
  uint place = started_place();
  if (place >= args.end) return;
#ifdef IMAGE_LISTED
  place = listed[place];
#endif
  const Pixel pixel = pixel_of(place);
  if (!pixel.is_inside) return;
  const CameraRecord camera = cameras[pixel.image];
  write_hit_outputs(pixel, camera, camera_ray(pixel, camera, middle), fetch_hit(hits, place));
}
