// The structures that rays search, bound as images: on lavapipe a texel of an image is loaded without a
// function call, and the lanes of a packet load one texel each.
#ifndef RTSTDB_QUERY_SIMD8_RAY_IMAGES_GLSL
#define RTSTDB_QUERY_SIMD8_RAY_IMAGES_GLSL
#include "common/instance.glsl"
#include "shared/node.h"

layout(set = 0, binding = 0, rgba32ui) readonly uniform uimageBuffer nodes;  // of geometries
layout(set = 0, binding = 1, rgba32ui) readonly uniform uimageBuffer triangles;
layout(set = 0, binding = 2, rgba32ui) readonly uniform uimageBuffer tlas;
layout(set = 0, binding = 3, rgba32ui) readonly uniform uimageBuffer instances;

Instance instance_at(uint index) {
  const int base = int(index * instance_texels);
  return instance_from(
      uintBitsToFloat(imageLoad(instances, base)), uintBitsToFloat(imageLoad(instances, base + 1)),
      uintBitsToFloat(imageLoad(instances, base + 2)), uintBitsToFloat(imageLoad(instances, base + 3)),
      uintBitsToFloat(imageLoad(instances, base + 4)));
}

uvec4 head_of(uint node) { return imageLoad(nodes, int(node * node_texels)); }

vec4 triangle_texel(int place) { return uintBitsToFloat(imageLoad(triangles, place)); }

#endif
