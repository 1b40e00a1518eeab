#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How far the surfaces are that the rasteriser has drawn for a camera: the largest and the least depth of its
// pixels, near_m over the distance along the view direction. Place: a pixel.
#include "query/image/image.glsl"

layout(set = 0, binding = 4, scalar) readonly buffer DepthsBuffer { uint depths[]; };
layout(set = 0, binding = 5, scalar) buffer ReachBuffer { uvec2 reach_of_image[]; };

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  const uint bits = depths[place];  // of numbers that are not negative, in whose order their bits are
  if (bits == 0u) return;           // nothing was drawn
  atomicMax(reach_of_image[args.image].x, bits);
  atomicMin(reach_of_image[args.image].y, bits);
}
