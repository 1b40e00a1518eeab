// The least time in which two surfaces can come nearer to each other than half the tolerance: a search of
// both trees at once, the pair of boxes first that can be so near first. Two convex sets that are apart along
// a normal come no nearer along it than their closing speed allows (Tang et al., "C2A: Controlled
// Conservative Advancement for Continuous Collision Detection", 2009).
//
// Included after the bindings `nodes`, `triangles` and `geometries`.
#ifndef RTSTDB_QUERY_IMPACT_SURFACE_APPROACH_GLSL
#define RTSTDB_QUERY_IMPACT_SURFACE_APPROACH_GLSL
#include "query/contact/surface.glsl"
#include "query/contact/triangle_pair.glsl"
#include "shared/impact.h"

// A surface in the frame of the search, which is the second entity's, rotated but not scaled.
struct PosedSurface {
  uint geometry;
  vec3 scale;
  mat3 axes;
  vec3 origin;
};

// How two surfaces move, in the frame of the search.
struct Approach {
  PosedSurface first;
  PosedSurface second;
  vec3 v_mps;  // of the first origin relative to the second one
  vec3 w_first_radps;
  vec3 w_second_radps;
  float tolerance_m;
  float rounding_m;  // of positions in single precision
};

// Skips pairs that can not meet within this fraction of the least time so far, and boxes that are not nearer
// than that fraction of the least distance so far.
const float time_fraction = 0.75;
const float distance_fraction = 0.91;

// The least time in which two convex sets come nearer than half the tolerance. They are apart by `distance_m`
// along n, which is unit and has this error. Reaches: of their farthest points from the origins.
float time_to_meet(Approach approach, float distance_m, vec3 n, float n_error, float first_reach_m,
                   float second_reach_m) {
  const float any_speed = length(approach.v_mps) + length(approach.w_first_radps) * first_reach_m +
                          length(approach.w_second_radps) * second_reach_m;
  const float along_n = length(cross(n, approach.w_first_radps)) * first_reach_m +
                        length(cross(n, approach.w_second_radps)) * second_reach_m - dot(n, approach.v_mps);
  const float closing = along_n + (n_error + 2e-6) * any_speed;
  return closing > 0.0 ? max(distance_m - 0.5 * approach.tolerance_m, 0.0) / closing : nowhere;
}

// A subtree has a number: node << 3 | child for a child of a node, whole_surface for the whole tree.
const uint whole_surface = 0xFFFFFFFFu;
struct Subtree {
  uint reference;
  vec3 lo;  // entity frame, unscaled
  vec3 hi;
};

Subtree subtree_at(uint number, uint geometry) {
  if (number == whole_surface) {
    const int base = int(geometry * geometry_texels);
    const vec3 center = uintBitsToFloat(texelFetch(geometries, base).xyz);
    const vec3 half_extent = uintBitsToFloat(texelFetch(geometries, base + 1).xyz);
    return Subtree(root_of(geometry), center - half_extent, center + half_extent);
  }
  const WideNode wide = fetch_wide_node(nodes, number >> 3);
  const uint k = number & 7u;
  return Subtree(child_reference(wide, k), child_lo(wide, k), child_hi(wide, k));
}

struct PosedBox {
  vec3 center;
  vec3 half_extent;
  float reach;  // of its farthest point from the entity's origin
};

// Contains the box in the frame of the search.
PosedBox posed_box(PosedSurface surface, vec3 lo, vec3 hi) {
  const mat3 s = mat3(abs(surface.axes[0]), abs(surface.axes[1]), abs(surface.axes[2]));
  return PosedBox(surface.axes * (0.5 * (lo + hi) * surface.scale) + surface.origin,
                  s * (0.5 * (hi - lo) * surface.scale), length(max(abs(lo), abs(hi)) * surface.scale));
}

Triangle posed_triangle(PosedSurface surface, uint slot) {
  const Triangle t = fetch_triangle(slot);
  return Triangle(surface.axes * (t.a * surface.scale) + surface.origin,
                  surface.axes * (t.b * surface.scale) + surface.origin,
                  surface.axes * (t.c * surface.scale) + surface.origin, t.index);
}

Triangle moved(Triangle t, vec3 by) { return Triangle(t.a + by, t.b + by, t.c + by, t.index); }

// The search of a step. The time is 0 once triangles were found that are within the tolerance; then the
// nearest ones are searched.
ApproachSearch search;
uint pending_first[max_subtree_pairs];  // numbers of subtrees
uint pending_second[max_subtree_pairs];
float pending_after_s[max_subtree_pairs];
const uint pending_limit = max_subtree_pairs - 8u;  // a visit adds at most 8

void begin_search(float within_s) {
  search.pending = 1u;
  search.visits = 0u;
  // Later times are of no interest.
  search.after_s = max(1.01 / time_fraction * within_s, 1e-9);
  search.square = nowhere;
  pending_first[0] = whole_surface;
  pending_second[0] = whole_surface;
  pending_after_s[0] = 0.0;
}

bool is_in_reach(float after_s) {
  return search.after_s > 0.0 ? after_s < time_fraction * search.after_s
                              : after_s == 0.0 && search.square > 0.0;
}

// The least time in which the contents of two boxes meet: 0 for boxes within the tolerance, so that all
// triangles within it are found; `nowhere` for boxes without nearer triangles.
float time_of_boxes(Approach approach, PosedBox a, PosedBox b) {
  const vec3 between = a.center - b.center;
  const vec3 apart = max(abs(between) - a.half_extent - b.half_extent, vec3(0.0));
  const float distance_m = max(length(apart) - approach.rounding_m, 0.0);
  if (distance_m * distance_m >= distance_fraction * distance_fraction * search.square) return nowhere;
  if (distance_m <= approach.tolerance_m) return 0.0;
  return time_to_meet(approach, distance_m, normalize(apart) * sign(between), 0.0, a.reach, b.reach);
}

// Adds the pairs of each child of one subtree with the other subtree; the next one to visit last.
void expand(Approach approach, PosedSurface surface, uint node, PosedBox other, uint other_number,
            bool is_first) {
  const WideNode wide = fetch_wide_node(nodes, node);
  uint next = 0u;
  float next_s = nowhere;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint number = node << 3 | k;
    const PosedBox box = posed_box(surface, child_lo(wide, k), child_hi(wide, k));
    const float after_s = child_reference(wide, k) == ref_none ? nowhere
                          : is_first                           ? time_of_boxes(approach, box, other)
                                                               : time_of_boxes(approach, other, box);
    const bool adds = after_s < nowhere && is_in_reach(after_s);
    const bool is_sooner = adds && after_s < next_s;
    // The sooner one becomes the next, and the other one is added.
    const uint added = is_sooner ? next : number;
    pending_first[search.pending] = is_first ? added : other_number;
    pending_second[search.pending] = is_first ? other_number : added;
    pending_after_s[search.pending] = is_sooner ? next_s : after_s;
    search.pending += (is_sooner ? next_s < nowhere : adds) ? 1u : 0u;
    next = is_sooner ? number : next;
    next_s = is_sooner ? after_s : next_s;
  }
  if (next_s < nowhere) {
    pending_first[search.pending] = is_first ? next : other_number;
    pending_second[search.pending] = is_first ? other_number : next;
    pending_after_s[search.pending] = next_s;
    ++search.pending;
  }
}

float reach_of(PosedSurface surface, Triangle t) { return farthest_from(t, surface.origin); }

void visit_triangles(Approach approach, uint first_slot, uint second_slot) {
  const Triangle of_first = posed_triangle(approach.first, first_slot);
  const Triangle of_second = posed_triangle(approach.second, second_slot);
  const vec3 near = center_of(of_first);
  const TriangleGap gap = gap_between(moved(of_first, -near), moved(of_second, -near));
  const float distance_m = sqrt(gap.square);
  if (distance_m <= approach.tolerance_m) {
    search.after_s = 0.0;
    if (gap.square < search.square) {
      search.square = gap.square;
      search.first = gap.first + near;
      search.between = gap.first - gap.second;
    }
  } else {
    const float after_s =
        time_to_meet(approach, distance_m, (gap.first - gap.second) / distance_m,
                     min(4.0 * approach.rounding_m / distance_m, 2.0), reach_of(approach.first, of_first),
                     reach_of(approach.second, of_second));
    search.after_s = min(search.after_s, after_s);
  }
}

uint count_of(uint leaf) { return (leaf >> ref_triangle_count_shift & 0xFu) + 1u; }

// Visits the next pair of subtrees that is in reach. Returns the number of visits of subtrees and triangles;
// 0: none is in reach, and the search ends.
uint visit_next(Approach approach) {
  uint first = 0u;
  uint second = 0u;
  bool is_found = false;
  do {
    ++rounds;
    if (!is_found && search.pending > 0u) {
      --search.pending;
      is_found = is_in_reach(pending_after_s[search.pending]);
      first = pending_first[search.pending];
      second = pending_second[search.pending];
    }
  } while (!is_found && search.pending > 0u);
  if (!is_found) return 0u;
  const Subtree a = subtree_at(first, approach.first.geometry);
  const Subtree b = subtree_at(second, approach.second.geometry);
  const PosedBox box_a = posed_box(approach.first, a.lo, a.hi);
  const PosedBox box_b = posed_box(approach.second, b.lo, b.hi);
  // A nearer pair of triangles may have been found since the pair was added.
  if (!is_in_reach(time_of_boxes(approach, box_a, box_b))) return 1u;
  const bool a_is_larger =
      dot(box_a.half_extent, box_a.half_extent) >= dot(box_b.half_extent, box_b.half_extent);
  if (is_inner(a.reference) && (a_is_larger || !is_inner(b.reference))) {
    expand(approach, approach.first, a.reference, box_b, second, true);
    return 1u;
  }
  if (is_inner(b.reference)) {
    expand(approach, approach.second, b.reference, box_a, first, false);
    return 1u;
  }
  const uint b_count = count_of(b.reference);
  const uint pairs = count_of(a.reference) * b_count;
  uint k = 0u;
  do {
    ++rounds;
    if (k < pairs) {
      visit_triangles(approach, (a.reference & ref_triangle_first_mask) + k / b_count,
                      (b.reference & ref_triangle_first_mask) + k % b_count);
      ++k;
    }
  } while (k < pairs);
  return 1u + pairs;
}

#endif
