#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// BLAS build: writes the wide nodes of a level, and the contents of their leaves for the pass that writes
// triangles.
#include "build/tree_choice.glsl"
#include "build/blas_node.glsl"
#include "build/leaf_order.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint index = gl_GlobalInvocationID.x;
  if (index >= args.node_count) return;
  const uvec4 entry = queue[index];
  const uvec4 low = children[2u * index];
  const uvec4 high = children[2u * index + 1u];
  const uint child[8] = uint[8](low.x, low.y, low.z, low.w, high.x, high.y, high.z, high.w);
  uint first = entry.y;
  uint next = args.node_base + entry.w;
  WideNode node;
  node.count = entry.z >> 8;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const bool used = k < node.count;
    // Unused slots repeat the first child, which changes no box.
    const uint here = used ? child[k] : child[0];
    const bool inner = (entry.z >> k & 1u) != 0u;
    const uint count = primitives_below(here);
    node.box[k] = box_of(here);
    node.reference[k] =
        inner ? next : ref_leaf_bit | (count - 1u) << ref_triangle_count_shift | (args.leaf_base + first);
    [[unroll]] for (uint rank = 0u; rank < max_triangles_per_leaf; ++rank) {
      if (used && !inner && rank < count) words[first + rank] = in_leaf(here, rank);
    }
    next += inner ? 1u : 0u;
    first += used ? count : 0u;
  }
  write_wide_node(index, node);
}
