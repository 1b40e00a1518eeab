#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// BLAS build of a deforming geometry: the corners and the index of each triangle in leaf order.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u)
    store_texel(destination_of(args.target, i, 16u), 0u, texelFetch(corners, int(words[i])));
}
