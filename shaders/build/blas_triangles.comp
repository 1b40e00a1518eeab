#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Geometry builder, last: triangles in the order of the leaves, three corners each, with their own number; and that order.
#include "build/leaf_order.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u) {
    const uint number = primitive_in_leaf(words[i]);
    words[i] = number;
    const uvec4 triangle = texelFetch(corners, int(number));
    const Destination to = destination_of(args.target, i, 16u * triangle_texels);
    store_texel(to, 0u, uvec4(floatBitsToUint(position(triangle.x)), triangle.w));
    store_texel(to, 1u, uvec4(floatBitsToUint(position(triangle.y)), 0u));
    store_texel(to, 2u, uvec4(floatBitsToUint(position(triangle.z)), 0u));
  }
}
