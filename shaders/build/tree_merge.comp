#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, step 4: builds the binary tree over the sorted codes bottom-up in one pass (Apetrei 2014,
// "Fast and Simple Agglomerative LBVH Construction"), improves it by rotations and computes the costs of its
// nodes. Of the two children of a node, the invocation that arrives second proceeds to the parent. No
// invocation waits, so the pass assumes no forward progress between workgroups. The result for a node depends
// on its subtrees alone, not on the order of arrival.
//
// Rotations (Kensler 2008, "Tree Rotations for Improving Bounding Volume Hierarchies"): at a node with
// children a = (e, f) and b = (c, d), a child is swapped with a grandchild, or two grandchildren are swapped,
// if that reduces the surface of a and b. A node's children are final, and its box and cost are known, once
// its parent has been created.
#include "build/tree_cost.glsl"

layout(local_size_x = 64) in;

float joint_area(Subtree a, Subtree b) { return box_half_area(box_union(a.box, b.box)); }

Subtree select(bool first, Subtree a, Subtree b) {
  Subtree chosen;
  chosen.node = first ? a.node : b.node;
  chosen.primitives = first ? a.primitives : b.primitives;
  chosen.decision = 0u;
  chosen.box.lo = first ? a.box.lo : b.box.lo;
  chosen.box.hi = first ? a.box.hi : b.box.hi;
  [[unroll]] for (uint i = 0u; i < 7u; ++i) chosen.cost[i] = first ? a.cost[i] : b.cost[i];
  return chosen;
}

// The rotation with the largest gain, or 6 if none of 0..5 gains.
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
  // A gain below the rounding error does not count.
  float best = -1e-6 * box_half_area(box_union(a, b));
  uint which = 6u;
  [[unroll]] for (uint k = 0u; k < 6u; ++k) {
    which = change[k] < best ? k : which;
    best = min(best, change[k]);
  }
  return which;
}

// Creates `node` from a and b, whose children may still be swapped.
void make_node(uint node, uint a, uint b) {
  const bool opens_a = !is_leaf(a);
  const bool opens_b = !is_leaf(b);
  const uvec2 in_a = children_of(opens_a ? a : 0u);
  const uvec2 in_b = children_of(opens_b ? b : 0u);
  // A leaf takes the place of its children.
  const Subtree e = load_subtree(opens_a ? in_a.x : a);
  const Subtree f = load_subtree(opens_a ? in_a.y : a);
  const Subtree c = load_subtree(opens_b ? in_b.x : b);
  const Subtree d = load_subtree(opens_b ? in_b.y : b);
  const uint which = best_rotation(opens_a, opens_b, e, f, c, d);
  // Two nodes remain to be created below this one: `inner` from two grandchildren, and `outer` from the other
  // two, or from `inner` and one of them.
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

// One loop serves all leaves of the run. Each invocation first climbs to the next node that it has to create,
// starting at the next leaf where a climb ends; then all invocations of a subgroup create their nodes
// together, since that is expensive and masked invocations execute it too.
void main() {
  const uint last_leaf = args.count - 1u;
  const uint end = state[blas_disorder] == 0u ? run_end() : 0u;
  uint leaf = run_begin();
  uint node = args.count + leaf;
  uint first = leaf;
  uint last = leaf;
  while (leaf < end) {
    uint created = no_node;
    while (leaf < end && created == no_node) {
      const bool whole = first == 0u && last == last_leaf;
      // The neighbour whose code differs later is nearer.
      const uint after = offsets[last];
      const uint before = offsets[max(first, 1u) - 1u];
      const bool left_child = first == 0u || (last != last_leaf && after < before);
      const uint parent = left_child ? last : first - 1u;
      if (!whole) binary[parent][left_child ? 0 : 1] = node;
      divergent_fence();
      uint other = no_node;
      if (whole) {
        state[blas_root] = node;
      } else {
        other = atomicExchange(arrivals[parent], left_child ? first : last);
      }
      divergent_fence();
      if (other == no_node) {
        ++leaf;
        node = args.count + leaf;
        first = last = leaf;
      } else {
        first = left_child ? first : other;
        last = left_child ? other : last;
        created = parent;
      }
      // A node over two leaves has no rotation.
      if (created != no_node && last - first == 1u) {
        node = parent;
        created = no_node;
      }
    }
    if (created != no_node) {
      const uvec2 children = children_of(created);
      make_node(created, children.x, children.y);
      node = created;
    }
  }
}
