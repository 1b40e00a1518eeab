#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, 4: the binary tree over the sorted codes in one climb (Apetrei 2014, "Fast and Simple Agglomerative LBVH
// Construction"), improved on the way, with what its nodes cost. Of the two children of a node the one that arrives second goes
// on to the parent; nobody waits, so no forward progress between workgroups is assumed. What is done to a node depends on its
// subtrees alone and not on who arrived first.
//
// Improved by rotations (Kensler 2008, "Tree Rotations for Improving Bounding Volume Hierarchies"): about a node with children
// a = (e, f) and b = (c, d), a child changes places with a grandchild, or two grandchildren with one another, where that makes
// the boxes of a and b smaller. A node's children are final, and its box and its cost are known, when its parent has been made.
#include "build/tree_cost.glsl"

layout(local_size_x = 64) in;

float joint_area(Subtree a, Subtree b) { return box_half_area(box_union(a.box, b.box)); }

Subtree select(bool first, Subtree a, Subtree b) {
  Subtree chosen;
  chosen.node = first ? a.node : b.node;
  chosen.primitives = first ? a.primitives : b.primitives;
  chosen.how = 0u;
  chosen.box.lo = first ? a.box.lo : b.box.lo;
  chosen.box.hi = first ? a.box.hi : b.box.hi;
  [[unroll]] for (uint i = 0u; i < 7u; ++i) chosen.cost[i] = first ? a.cost[i] : b.cost[i];
  return chosen;
}

// Which rotation gains most; none of 0..5 does: 6.
//   0  c <-> a    1  d <-> a    2  e <-> b    3  f <-> b    4  f <-> c    5  f <-> d
uint best_rotation(bool opens_a, bool opens_b, Subtree e, Subtree f, Subtree c, Subtree d) {
  const float never = 3e38;
  const Box a = box_union(e.box, f.box);
  const Box b = box_union(c.box, d.box);
  const float a_area = box_half_area(a);
  const float b_area = box_half_area(b);
  const bool opens_both = opens_a && opens_b;
  float change[6];
  change[0] = opens_b ? box_half_area(box_union(a, d.box)) - b_area : never;
  change[1] = opens_b ? box_half_area(box_union(a, c.box)) - b_area : never;
  change[2] = opens_a ? box_half_area(box_union(b, f.box)) - a_area : never;
  change[3] = opens_a ? box_half_area(box_union(b, e.box)) - a_area : never;
  change[4] = opens_both ? joint_area(e, c) + joint_area(f, d) - a_area - b_area : never;
  change[5] = opens_both ? joint_area(e, d) + joint_area(f, c) - a_area - b_area : never;
  // Less than rounding is no gain.
  float best = -1e-6 * box_half_area(box_union(a, b));
  uint which = 6u;
  [[unroll]] for (uint k = 0u; k < 6u; ++k) {
    which = change[k] < best ? k : which;
    best = min(best, change[k]);
  }
  return which;
}

// Makes `node` from a and b, which are final but for their children.
void make_node(uint node, uint a, uint b) {
  const bool opens_a = !is_leaf(a);
  const bool opens_b = !is_leaf(b);
  const uvec2 in_a = children_of(opens_a ? a : 0u);
  const uvec2 in_b = children_of(opens_b ? b : 0u);
  // A leaf stands for its children.
  const Subtree e = load_subtree(opens_a ? in_a.x : a);
  const Subtree f = load_subtree(opens_a ? in_a.y : a);
  const Subtree c = load_subtree(opens_b ? in_b.x : b);
  const Subtree d = load_subtree(opens_b ? in_b.y : b);
  const uint which = best_rotation(opens_a, opens_b, e, f, c, d);
  // Two nodes are left to make below this one: `inner` from two grandchildren, `outer` from the other two or from `inner` and
  // one of them.
  const bool b_inside = which == 2u || which == 3u;
  const bool nested = which < 4u;
  const bool opens_inner = b_inside ? opens_b : opens_a;
  const bool opens_outer = b_inside ? opens_a : opens_b;
  const Subtree p = select(b_inside, c, e);
  const Subtree q = select(which == 4u, c, select(which == 5u || b_inside, d, f));
  Subtree inner = join(b_inside ? b : a, p, q);
  if (opens_inner) store_subtree(inner, p.node, q.node);
  inner = select(opens_inner, inner, p);
  const Subtree r = select(nested, inner, select(which == 6u, c, f));
  const Subtree s = select(which == 2u, f, select(which == 3u, e, select(which == 1u || which == 5u, c, d)));
  const Subtree outer = join(b_inside ? a : b, r, s);
  if (opens_outer) store_subtree(outer, r.node, s.node);
  const uint promoted = which == 0u ? c.node : which == 1u ? d.node : which == 2u ? e.node : f.node;
  binary[node] = uvec2(which >= 2u ? a : b, nested ? promoted : b);
}

// All climbs of the run are one: where one ends the next begins at once, and each invocation comes to its next node that is to be
// made before any of its subgroup makes one, since making is dear and masked invocations run along.
void main() {
  const uint last_leaf = args.count - 1u;
  const uint end = state[blas_disorder] == 0u ? run_end() : 0u;
  uint leaf = run_begin();
  uint node = args.count + leaf;
  uint first = leaf;
  uint last = leaf;
  while (leaf < end) {
    uint made = nobody;
    while (leaf < end && made == nobody) {
      const bool whole = first == 0u && last == last_leaf;
      // The neighbour whose codes part later is nearer.
      const uint after = offsets[last];
      const uint before = offsets[max(first, 1u) - 1u];
      const bool left_child = first == 0u || (last != last_leaf && after < before);
      const uint parent = left_child ? last : first - 1u;
      if (!whole) binary[parent][left_child ? 0 : 1] = node;
      divergent_fence();
      uint other = nobody;
      if (whole) {
        state[blas_root] = node;
      } else {
        other = atomicExchange(arrivals[parent], left_child ? first : last);
      }
      divergent_fence();
      if (other == nobody) {
        ++leaf;
        node = args.count + leaf;
        first = last = leaf;
      } else {
        first = left_child ? first : other;
        last = left_child ? other : last;
        made = parent;
      }
      // Two leaves: nothing to rotate.
      if (made != nobody && last - first == 1u) {
        node = parent;
        made = nobody;
      }
    }
    if (made != nobody) {
      const uvec2 children = children_of(made);
      make_node(made, children.x, children.y);
      node = made;
    }
  }
}
