#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Geometry builder: writes the wide nodes from args.first to args.end, and the order of the triangles in their leaves.
#include "build/blas_choice.glsl"
#include "build/blas_node.glsl"

layout(local_size_x = 64) in;

// Puts the triangles below a child into the order of the leaves from `first` on.
void order_leaf(uint child, uint first) {
  uint waiting[max_triangles_per_leaf];
  waiting[0] = child;
  uint depth = 1u;
  uint place = args.half_size + first;
  while (depth != 0u) {
    const uint node = waiting[--depth];
    if (is_leaf(node)) {
      values[place++] = values[node - args.count];
    } else {
      waiting[depth++] = binary[node].y;
      waiting[depth++] = binary[node].x;
    }
  }
}

void main() {
  const uint index = args.first + gl_GlobalInvocationID.x;
  if (index >= args.end) return;
  const Choice choice = choose_children(queue[index].x);
  uint first = queue[index].y;
  uint next = args.node_base + offsets[index];
  WideNode node;
  node.count = choice.count;
  for (uint k = 0u; k < choice.count; ++k) {
    const uint child = choice.child[k];
    const uint count = triangles_below(child);
    const bool inner = (choice.inner >> k & 1u) != 0u;
    node.box[k] = box_of(child);
    node.reference[k] =
        inner ? next : ref_leaf_bit | (count - 1u) << ref_triangle_count_shift | (args.leaf_base + first);
    if (!inner) order_leaf(child, first);
    next += inner ? 1u : 0u;
    first += count;
  }
  write_wide_node(gl_GlobalInvocationID.x, node);
}
