#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Geometry builder, for a geometry that deforms: which corners each triangle has in the order of the leaves, and its own number.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u)
    store_texel(destination_of(args.target, i, 16u), 0u, texelFetch(corners, int(words[i])));
}
