// Tree builder, 3: what the binary tree is made from: boxes in sorted order, and how early neighbours' codes part. The
// earlier, the larger: the highest bit that differs, below it that of the places where codes are the same.
#include "build/tree_scratch.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u) {
    const Box box = box_of_primitive(values[i]);
    box_lo[args.count + i] = box.lo;
    box_hi[args.count + i] = box.hi;
    arrivals[i] = nobody;
    const uvec2 difference = keys[i] ^ keys[min(i + 1u, args.count - 1u)];
    const uint low = difference.x != 0u ? 32u + uint(findMSB(difference.x)) : uint(findMSB(i ^ (i + 1u)));
    offsets[i] = difference.y != 0u ? 64u + uint(findMSB(difference.y)) : low;
  }
}
