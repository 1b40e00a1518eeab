#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Refit of a deforming geometry, step 2, once per level from the deepest up. Computes the boxes of the nodes
// from those of their children and leaves slots and references as they are. Also computes the cost of each
// subtree for a ray, and the cost of its triangles alone, which is a lower bound for any tree.
#include "build/quantum.glsl"
#include "build/sah_costs.glsl"
#include "shared/blas.h"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BlasRefitArgs args; };
// The nodes of this geometry, and the pool, which is the same memory.
layout(set = 0, binding = 0, scalar) writeonly buffer WideBuffer { uvec4 wide[]; };
layout(set = 0, binding = 1) uniform usamplerBuffer nodes;
layout(set = 0, binding = 2) uniform samplerBuffer triangles;
// Two texels per node: low corner and cost, high corner and cost of the triangles. The level above fetches
// them.
layout(set = 0, binding = 3, scalar) writeonly buffer BoxesBuffer { vec4 boxes[]; };
layout(set = 0, binding = 4) uniform samplerBuffer boxes_below;

const Box nothing = Box(vec3(3e38), vec3(-3e38));

// Loops over slots have constant trip counts, so that the compiler keeps arrays in registers.
struct Children {
  Box box[8];
  Box all;
  float cost;
  float min_cost;
};

Children children_of(uint used, uvec4 references[2]) {
  Children children;
  children.all = nothing;
  children.cost = children.min_cost = 0.0;
  [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) {
    const uint reference = references[slot >> 2][slot & 3u];
    const bool is_used = (used >> slot & 1u) != 0u;
    const bool leaf = is_used && (reference & ref_leaf_bit) != 0u;
    const int below = is_used && !leaf ? int(2u * (reference - args.node_base)) : 0;
    const vec4 low = texelFetch(boxes_below, below);
    const vec4 high = texelFetch(boxes_below, below + 1);
    float min_cost = leaf ? 0.0 : high.w;
    Box box = Box(leaf ? nothing.lo : low.xyz, leaf ? nothing.hi : high.xyz);
    const uint count = leaf ? (reference >> ref_triangle_count_shift & 15u) + 1u : 0u;
    const int first = int((reference & ref_triangle_first_mask) * triangle_texels);
    for (int corner = first; corner < first + int(triangle_texels * count); corner += int(triangle_texels)) {
      const vec3 p = texelFetch(triangles, corner).xyz;
      const vec3 q = texelFetch(triangles, corner + 1).xyz;
      const vec3 r = texelFetch(triangles, corner + 2).xyz;
      const Box own = Box(min(p, min(q, r)), max(p, max(q, r)));
      min_cost += triangle_cost * box_half_area(own);
      box = box_union(box, own);
    }
    const float cost = leaf ? triangle_cost * float(count) * box_half_area(box) : low.w;
    children.box[slot] = box;
    children.all.lo = is_used ? min(children.all.lo, box.lo) : children.all.lo;
    children.all.hi = is_used ? max(children.all.hi, box.hi) : children.all.hi;
    children.cost += is_used ? cost : 0.0;
    children.min_cost += is_used ? min_cost : 0.0;
  }
  return children;
}

void write_node(uint node, uint used, Children children) {
  const Quanta quanta = quanta_of(children.all);
  uvec3 low_edges[2] = uvec3[2](uvec3(0u), uvec3(0u));
  uvec3 high_edges[2] = uvec3[2](uvec3(0u), uvec3(0u));
  [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) {
    const bool is_used = (used >> slot & 1u) != 0u;
    const uint bit = 8u * (slot & 3u);
    // An unused slot holds an inverted box, which no ray enters.
    low_edges[slot >> 2] |= (is_used ? low_edge(children.box[slot].lo, quanta) : uvec3(255u)) << bit;
    high_edges[slot >> 2] |= (is_used ? high_edge(children.box[slot].hi, quanta) : uvec3(0u)) << bit;
  }
  const uint base = node * node_texels;
  wide[base] = uvec4(floatBitsToUint(quanta.origin), quanta.exponents | used << 24);
  wide[base + 1u] = uvec4(low_edges[0].x, low_edges[1].x, high_edges[0].x, high_edges[1].x);
  wide[base + 2u] = uvec4(low_edges[0].y, low_edges[1].y, high_edges[0].y, high_edges[1].y);
  wide[base + 3u] = uvec4(low_edges[0].z, low_edges[1].z, high_edges[0].z, high_edges[1].z);
}

void main() {
  if (gl_GlobalInvocationID.x >= args.count) return;
  const uint node = args.first + gl_GlobalInvocationID.x;
  const int texel = int((args.node_base + node) * node_texels);
  const uint used = texelFetch(nodes, texel).w >> 24;
  const uvec4 references[2] = uvec4[2](texelFetch(nodes, texel + 4), texelFetch(nodes, texel + 5));
  const Children children = children_of(used, references);
  write_node(node, used, children);
  boxes[2u * node] = vec4(children.all.lo, children.cost + node_cost * box_half_area(children.all));
  boxes[2u * node + 1u] = vec4(children.all.hi, children.min_cost);
}
