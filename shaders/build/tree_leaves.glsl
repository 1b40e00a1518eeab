// Tree builder, 3: what the binary tree is made from: boxes in sorted order, and how early neighbours' codes part. The
// earlier, the larger: the highest bit that differs, below it that of the places where codes are the same. Codes that the sort
// left in disorder are told of, and no tree is made from them.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

uint low_word(uint primitive) { return keys[2u * args.half_size + primitive]; }

void main() {
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u) {
    const Box box = box_of_primitive(values[i]);
    const uint texel = uint(texel_of(args.count + i));
    store_texel(args.target, texel, uvec4(floatBitsToUint(box.lo), 0u));
    store_texel(args.target, texel + 1u, uvec4(floatBitsToUint(box.hi), 0u));
    arrivals[i] = nobody;
    const uint next = min(i + 1u, args.count - 1u);
    const uint high = keys[i] ^ keys[next];
    uint parts = 64u + uint(findMSB(high));
    if (high == 0u) {
      const uint here = low_word(values[i]);
      const uint there = low_word(values[next]);
      const uint low = here ^ there;
      parts = low != 0u ? 32u + uint(findMSB(low)) : uint(findMSB(i ^ (i + 1u)));
      if (here > there) state[blas_disorder] = 1u;
    }
    offsets[i] = parts;
  }
}
