// The winding number of a geometry's surface around a point: a vertical ray starts at the point, and each
// triangle that it crosses adds 1 or -1, depending on the side that it shows. This needs the triangles alone,
// unlike angle-weighted pseudonormals (Baerentzen and Aanaes 2005).
//
// Included after the bindings `nodes` and `triangles`.
#ifndef RTSTDB_QUERY_NEAREST_WINDING_GLSL
#define RTSTDB_QUERY_NEAREST_WINDING_GLSL
#include "common/loops.glsl"
#include "common/wide_node.glsl"

const uint winding_stack_size = 128u;
// Every inner node pushes at most 8 references.
const uint winding_stack_limit = winding_stack_size - 8u;

// The winding of an edge around the origin, seen from above: +1 or -1 where it crosses the half line towards
// +y, by its direction. The reversed edge gives exactly the opposite, so over a closed surface the sum is
// right also where the vertical ray meets edges and corners.
int crossing(vec2 a, vec2 b) {
  precise float side = a.x * b.y - a.y * b.x;
  const bool leftwards = a.x > 0.0 && b.x <= 0.0;
  const bool rightwards = a.x <= 0.0 && b.x > 0.0;
  return (leftwards && side > 0.0 ? 1 : 0) - (rightwards && side < 0.0 ? 1 : 0);
}

float twice_area(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }

// The winding of a triangle around the vertical ray above the point.
int winding_above(vec3 a, vec3 b, vec3 c) {
  const float wa = twice_area(b.xy, c.xy);
  const float wb = twice_area(c.xy, a.xy);
  const float wc = twice_area(a.xy, b.xy);
  // The height at which the ray crosses, clamped to the corners' heights: rounding may move it far off for a
  // steep triangle.
  const float sum = wa + wb + wc;
  const float height = (wa * a.z + wb * b.z + wc * c.z) / (sum == 0.0 ? 1.0 : sum);
  const float clamped = clamp(height, min(a.z, min(b.z, c.z)), max(a.z, max(b.z, c.z)));
  const int winding = crossing(a.xy, b.xy) + crossing(b.xy, c.xy) + crossing(c.xy, a.xy);
  return clamped > 0.0 ? winding : 0;
}

struct Winding {
  int number;      // 0: outside of a closed surface
  bool cut_short;  // the search visited too many nodes
  uint rounds;
};

// `root`: of a closed geometry, or ref_none. The point is in the geometry's frame.
Winding winding_around(uint root, vec3 point) {
  uint stack[winding_stack_size];
  uint depth = 0u;
  uint rounds = 0u;
  bool cut_short = false;
  int winding = 0;
  uint current = root;
  while (current != ref_none) {
    rounds += 3u;
    while ((current & ref_leaf_bit) == 0u) {
      ++rounds;
      const WideNode wide = fetch_wide_node(nodes, current);
      [[unroll]] for (uint k = 0u; k < 8u; ++k) {
        const vec3 lo = child_lo(wide, k);
        const vec3 hi = child_hi(wide, k);
        const uint ref = child_reference(wide, k);
        stack[depth] = ref;
        const bool meets = all(lessThanEqual(lo.xy, point.xy)) && all(greaterThanEqual(hi, point));
        depth += meets && ref != ref_none ? 1u : 0u;
      }
      if (depth > winding_stack_limit || rounds > max_rounds) {
        cut_short = true;
        depth = 0u;
      }
      current = ref_none;
      if (depth == 0u) break;
      current = stack[--depth];
    }
    if (current == ref_none) break;
    const uint first = current & ref_triangle_first_mask;
    const uint count = (current >> ref_triangle_count_shift & 0xFu) + 1u;
    for (uint k = 0u; k < count; ++k) {
      ++rounds;
      const int base = int((first + k) * triangle_texels);
      winding +=
          winding_above(texelFetch(triangles, base).xyz - point, texelFetch(triangles, base + 1).xyz - point,
                        texelFetch(triangles, base + 2).xyz - point);
    }
    current = ref_none;
    if (rounds > max_rounds) {
      cut_short = true;
      break;
    }
    if (depth > 0u) current = stack[--depth];
  }
  return Winding(winding, cut_short, rounds);
}

#endif
