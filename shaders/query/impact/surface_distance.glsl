// The distance of two surfaces at a pose: a search of both trees at once, the nearest pair of boxes first.
//
// Included after the bindings `nodes`, `triangles` and `geometries`.
#ifndef RTSTDB_QUERY_IMPACT_SURFACE_DISTANCE_GLSL
#define RTSTDB_QUERY_IMPACT_SURFACE_DISTANCE_GLSL
#include "query/contact/surface.glsl"
#include "query/contact/triangle_pair.glsl"

// A surface in the frame of the search, which is the second entity's, rotated but not scaled.
struct PosedSurface {
  uint geometry;
  vec3 scale;
  mat3 axes;
  vec3 origin;
};

// The number of a part of a tree: node << 3 | child for a child of a node, whole_surface for the whole tree.
const uint whole_surface = 0xFFFFFFFFu;
struct TreePart {
  uint reference;
  vec3 lo;  // entity frame, unscaled
  vec3 hi;
};

TreePart part_at(uint number, uint geometry) {
  if (number == whole_surface) {
    const int base = int(geometry * geometry_texels);
    const vec3 center = uintBitsToFloat(texelFetch(geometries, base).xyz);
    const vec3 half_extent = uintBitsToFloat(texelFetch(geometries, base + 1).xyz);
    return TreePart(root_of(geometry), center - half_extent, center + half_extent);
  }
  const WideNode wide = fetch_wide_node(nodes, number >> 3);
  const uint k = number & 7u;
  return TreePart(child_reference(wide, k), child_lo(wide, k), child_hi(wide, k));
}

struct PosedBox {
  vec3 center;
  vec3 half_extent;
};

// Contains the box in the frame of the search.
PosedBox posed_box(PosedSurface surface, vec3 lo, vec3 hi) {
  const mat3 s = mat3(abs(surface.axes[0]), abs(surface.axes[1]), abs(surface.axes[2]));
  return PosedBox(surface.axes * (0.5 * (lo + hi) * surface.scale) + surface.origin,
                  s * (0.5 * (hi - lo) * surface.scale));
}

float square_between(PosedBox a, PosedBox b) {
  const vec3 apart = max(abs(a.center - b.center) - a.half_extent - b.half_extent, vec3(0.0));
  return dot(apart, apart);
}

Triangle posed_triangle(PosedSurface surface, uint slot) {
  const Triangle t = fetch_triangle(slot);
  return Triangle(surface.axes * (t.a * surface.scale) + surface.origin,
                  surface.axes * (t.b * surface.scale) + surface.origin,
                  surface.axes * (t.c * surface.scale) + surface.origin, t.index);
}

// Waiting pairs of tree parts: stack_ref has the numbers of the first parts, stack_second those of the second
// ones, stack_bound the lower bounds.
uint stack_second[stack_size];

struct WaitingPair {
  uint first;
  uint second;
  float square;  // lower bound of the squared distance
};

void offer_pair(WaitingPair pair, float limit, inout WaitingPair nearest) {
  const bool in_reach = pair.square < limit;
  const bool is_nearer = in_reach && pair.square < nearest.square;
  stack_ref[depth] = is_nearer ? nearest.first : pair.first;
  stack_second[depth] = is_nearer ? nearest.second : pair.second;
  stack_bound[depth] = is_nearer ? nearest.square : pair.square;
  depth += (is_nearer ? nearest.square < nowhere : in_reach) ? 1u : 0u;
  if (is_nearer) nearest = pair;
}

// Offers the pairs of each child of one part with the other part.
void expand(PosedSurface surface, uint node, PosedBox other, uint other_number, bool is_first, float limit,
            inout WaitingPair nearest) {
  const WideNode wide = fetch_wide_node(nodes, node);
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint number = node << 3 | k;
    const PosedBox box = posed_box(surface, child_lo(wide, k), child_hi(wide, k));
    const float square = child_reference(wide, k) != ref_none ? square_between(box, other) : nowhere;
    offer_pair(WaitingPair(is_first ? number : other_number, is_first ? other_number : number, square), limit,
               nearest);
  }
}

struct SurfaceDistance {
  float upper;  // metres: the distance of the nearest two triangles that were found
  float lower;  // a lower bound of the distance of the surfaces
  vec3 first;   // the nearest points of these triangles
  vec3 second;
};

// A search ends after so many pairs of parts and of triangles; its lower bound then comes from those that
// wait.
const uint max_visits = 2000u;

uint count_of(uint leaf) { return (leaf >> ref_triangle_count_shift & 0xFu) + 1u; }

// Skips pairs of boxes that are farther apart than 1 - slack times the least distance so far. The search ends
// when that distance is 0.
SurfaceDistance distance_between(PosedSurface first, PosedSurface second, float slack) {
  const float limit_per_square = (1.0 - slack) * (1.0 - slack);
  SurfaceDistance found = SurfaceDistance(nowhere, 0.0, vec3(0.0), vec3(0.0));
  float best = nowhere;
  depth = 0u;
  WaitingPair current = WaitingPair(whole_surface, whole_surface, 0.0);
  uint visits = 0u;
  bool goes_on = true;
  do {
    rounds += 2u;  // this loop's, and that of the leaves
    if (goes_on) {
      const float limit = best * limit_per_square;
      const TreePart a = part_at(current.first, first.geometry);
      const TreePart b = part_at(current.second, second.geometry);
      const PosedBox box_a = posed_box(first, a.lo, a.hi);
      const PosedBox box_b = posed_box(second, b.lo, b.hi);
      const bool a_is_larger =
          dot(box_a.half_extent, box_a.half_extent) >= dot(box_b.half_extent, box_b.half_extent);
      WaitingPair nearest = WaitingPair(0u, 0u, nowhere);
      if (is_inner(a.reference) && (a_is_larger || !is_inner(b.reference))) {
        expand(first, a.reference, box_b, current.second, true, limit, nearest);
      } else if (is_inner(b.reference)) {
        expand(second, b.reference, box_a, current.first, false, limit, nearest);
      } else {
        const uint b_count = count_of(b.reference);
        const uint pairs = count_of(a.reference) * b_count;
        uint k = 0u;
        do {
          ++rounds;
          if (k < pairs) {
            const Triangle of_first =
                posed_triangle(first, (a.reference & ref_triangle_first_mask) + k / b_count);
            const Triangle of_second =
                posed_triangle(second, (b.reference & ref_triangle_first_mask) + k % b_count);
            const vec3 near = center_of(of_first);
            const TriangleGap gap =
                gap_between(Triangle(of_first.a - near, of_first.b - near, of_first.c - near, 0u),
                            Triangle(of_second.a - near, of_second.b - near, of_second.c - near, 0u));
            if (gap.square < best) {
              best = gap.square;
              found.first = gap.first + near;
              found.second = gap.second + near;
            }
            ++k;
            ++visits;
          }
        } while (k < pairs);
      }
      ++visits;
      cut_short = cut_short || rounds > max_rounds;
      const float reach = best * limit_per_square;
      do {
        ++rounds;
        if (nearest.square >= reach && depth > 0u) {
          --depth;
          nearest = WaitingPair(stack_ref[depth], stack_second[depth], stack_bound[depth]);
        }
      } while (nearest.square >= reach && depth > 0u);
      current = nearest;
      goes_on = nearest.square < reach && visits < max_visits && depth <= stack_limit && !cut_short;
    }
  } while (goes_on);
  float min_square = min(best * limit_per_square, current.square);
  do {
    ++rounds;
    if (depth > 0u) {
      --depth;
      min_square = min(min_square, stack_bound[depth]);
    }
  } while (depth > 0u);
  found.upper = sqrt(best);
  found.lower = sqrt(min_square);
  return found;
}

#endif
