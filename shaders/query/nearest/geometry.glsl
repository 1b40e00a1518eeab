// The search for the triangles of one geometry that are nearest to a point.
//
// Included after nearest_first.glsl and the bindings `nodes` and `triangles`. box_limit: the square of the
// distance beyond which boxes are skipped.
#ifndef RTSTDB_QUERY_NEAREST_GEOMETRY_GLSL
#define RTSTDB_QUERY_NEAREST_GEOMETRY_GLSL
#include "common/loops.glsl"
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

const uint no_triangle = 0xFFFFFFFFu;

// The nearest triangle, or no_triangle, and its place in the leaf order.
struct NearestSlot {
  float square;  // of the distance
  uint triangle;
  uint slot;
  uint visits;  // nodes and triangles that the search visited; does not depend on other lanes
};

// Searches the triangles within `radius`. At equal distances the triangle with the lower index is taken, so
// that the answer does not depend on the order in which boxes are visited. Boxes farther away than 1 - slack
// times the nearest distance so far are skipped. Changes box_limit.
NearestSlot nearest_slot(uint root, vec3 scale, vec3 point, float radius, float slack) {
  const float limit_per_square = (1.0 + 2e-6) * (1.0 - slack) * (1.0 - slack);
  NearestSlot best = NearestSlot(radius * radius, no_triangle, 0u, 0u);
  box_limit = best.square * limit_per_square;
  const uint bottom = depth;
  uint current = root;
  if (current != ref_none) do {
      rounds += 3u;  // this loop's, and one for each of the two inside
      if (is_inner(current)) {
        current = nearest_triangle_child(current, scale, point);
        ++best.visits;
      }
      const bool is_leaf = current != ref_none && !is_inner(current);
      const uint first = current & ref_triangle_first_mask;
      const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
      uint k = 0u;
      if (is_leaf) do {
          ++rounds;
          if (k < count) {
            uint triangle;
            const float square = nearest_on_slot(first + k, scale, point, triangle).square;
            const bool better = square < best.square || (square == best.square && triangle < best.triangle);
            best.square = better ? square : best.square;
            best.triangle = better ? triangle : best.triangle;
            best.slot = better ? first + k : best.slot;
            ++best.visits;
            box_limit = best.square * limit_per_square;
            ++k;
          }
        } while (k < count);
      current = is_leaf ? ref_none : current;
      if (current == ref_none) current = next_waiting(bottom);
      cut_short = cut_short || rounds > max_rounds;
    } while (current != ref_none && !cut_short);
  return best;
}

#endif
