#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// BLAS build, last step: writes the triangles in leaf order, three corners and the index each; and that
// order.
#include "build/leaf_order.glsl"
#include "common/has_area.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u) {
    const uint number = primitive_in_leaf(words[i]);
    words[i] = number;
    const uvec4 triangle = texelFetch(corners, int(number));
    const Destination to = destination_of(args.target, i, 16u * triangle_texels);
    const vec3 a = position(triangle.x);
    const vec3 b = position(triangle.y);
    const vec3 c = position(triangle.z);
    store_texel(to, 0u, uvec4(floatBitsToUint(a), triangle.w));
    store_texel(to, 1u, uvec4(floatBitsToUint(b), has_area(a, b, c) ? 0u : triangle_without_area));
    store_texel(to, 2u, uvec4(floatBitsToUint(c), 0u));
  }
}
