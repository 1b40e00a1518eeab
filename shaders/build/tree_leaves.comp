#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, step 3: the input of the binary tree: boxes in sorted order, and for each pair of neighbours
// a number that is larger the earlier their codes differ (the highest differing bit, or that of the positions
// if the codes are equal). Sets a flag if the sort left codes unsorted; the tree is then not built.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u) {
    const uvec2 here = sorted[i];
    const Box box = box_of_primitive(here.y);
    const Destination to = destination_of(args.target, uint(texel_of(args.count + i)), 16u);
    store_texel(to, 0u, uvec4(floatBitsToUint(box.lo), 0u));
    store_texel(to, 1u, uvec4(floatBitsToUint(box.hi), 0u));
    arrivals[i] = no_node;
    const uint next = min(i + 1u, args.count - 1u);
    const uvec2 there = sorted[next];
    const uint high = here.x ^ there.x;
    uint parts = 64u + uint(findMSB(high));
    if (high == 0u) {
      const uint low_here = words[here.y];
      const uint low_there = words[there.y];
      const uint low = low_here ^ low_there;
      parts = low != 0u ? 32u + uint(findMSB(low)) : uint(findMSB(i ^ (i + 1u)));
      if (low_here > low_there) state[blas_disorder] = 1u;
    }
    offsets[i] = parts;
  }
}
