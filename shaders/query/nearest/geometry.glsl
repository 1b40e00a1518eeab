// The search for the triangles of one geometry that are nearest to a point.
//
// Included after nearest_first.glsl and the bindings `nodes` and `triangles`. box_limit: the square of the
// distance beyond which boxes are skipped.
#ifndef RTSTDB_QUERY_NEAREST_GEOMETRY_GLSL
#define RTSTDB_QUERY_NEAREST_GEOMETRY_GLSL
#include "common/wide_node.glsl"
#include "query/nearest_on_triangle.glsl"

float box_square(vec3 lo, vec3 hi, vec3 point) {
  precise vec3 below = lo - point;
  precise vec3 above = point - hi;
  const vec3 gap = max(max(below, above), vec3(0.0));
  return dot(gap, gap);
}

// Returns the child whose box is nearest and pushes the others within reach. Boxes are scaled by `scale`.
uint nearest_triangle_child(uint node, vec3 scale, vec3 point) {
  const WideNode wide = fetch_wide_node(nodes, node);
  uint nearest = ref_none;
  float nearest_square = 3.4e38;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    precise vec3 lo = child_lo(wide, k) * scale;
    precise vec3 hi = child_hi(wide, k) * scale;
    offer_child(child_reference(wide, k), box_square(lo, hi, point), nearest, nearest_square);
  }
  return unless_full(nearest);
}

TrianglePoint nearest_on_slot(uint slot, vec3 scale, vec3 point, out uint triangle) {
  const int base = int(slot * triangle_texels);
  const vec4 t0 = texelFetch(triangles, base);
  triangle = floatBitsToUint(t0.w);
  precise vec3 a = t0.xyz * scale;
  precise vec3 b = texelFetch(triangles, base + 1).xyz * scale;
  precise vec3 c = texelFetch(triangles, base + 2).xyz * scale;
  return nearest_on_triangle(a - point, b - point, c - point);
}

#endif
