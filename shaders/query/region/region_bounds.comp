#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The search of region and overlap queries for entities by their bounds: down the TLAS by axis-aligned boxes,
// then the exact test of oriented boxes at the query's own time, for those that cross the region's border.
//
// Leaves are collected in lists, and each list has a loop of its own: on lavapipe lanes wait for one another
// in every loop, and with lists they wait only for the lane with the most entries in total.
//
// Macros: REGION_MOVING where regions have different times (right for one instant too, but slower);
// REGION_FRUSTUM for frusta instead of boxes and spheres; and one of these, or none to list what is found:
//   REGION_LOWEST   for regions that found more ids than fit: finds the lowest ids, by a heap
//   REGION_COUNT    counts, without ids
//   REGION_PAIRS    for contact queries: each region has a space of its own in the list of ids
#define REGION_BOUNDS
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/packed_edges.glsl"
#include "common/places.glsl"
#include "query/child_group.glsl"
#ifdef REGION_FRUSTUM
#include "query/region/frustum.glsl"
#else
#include "query/region/box_or_sphere.glsl"
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RegionArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer tlas;
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2) uniform samplerBuffer still_bounds;
layout(set = 0, binding = 3, scalar) readonly buffer RegionsBuffer { RegionRecord regions[]; };
layout(set = 0, binding = 4, scalar) buffer CountsBuffer { RegionCount counts[]; };
#ifndef REGION_COUNT
layout(set = 0, binding = 5, scalar) buffer IdsBuffer { uint ids[]; };
#endif
#ifdef REGION_PAIRS
layout(set = 0, binding = 6, scalar) readonly buffer SpacesBuffer { uvec2 spaces[]; };  // begin, length
uint space_length = 0u;
#endif

// Groups of inner nodes: at most one per level of the tree.
const uint stack_size = 64u;
uint stack[stack_size];
uint depth = 0u;

// Groups of leaves: those to be tested, and those that certainly lie in the region.
const uint list_size = 32u;
uint border_list[list_size];
uint within_list[list_size];
uint border_count = 0u;
uint within_count = 0u;

uint rounds = 0u;
bool cut_short = false;

#define REGION_KEY uint
#include "query/region/keep.glsl"

// Collects the children of a node that meet the region; returns the next node.
uint visit(uint node, uint share, Shape shape) {
  const PackedNode packed = fetch_packed_node(tlas, node, share);
  const ChildMasks children = children_of(packed, shape);
  const uint meeting = children.meeting;
  const uint within = children.within;
  const uint border_leaves = meeting & packed.leaves & ~within;
  const uint within_leaves = meeting & packed.leaves & within;
  border_list[border_count] = node << 8 | border_leaves;
  border_count += border_leaves != 0u ? 1u : 0u;
  within_list[within_count] = node << 8 | within_leaves;
  within_count += within_leaves != 0u ? 1u : 0u;

  uint group = node << 8 | (meeting & ~packed.leaves);
  const bool pop = (group & 0xFFu) == 0u;
  const bool done = pop && depth == 0u;
  depth -= pop && !done ? 1u : 0u;
  group = pop ? stack[depth] : group;
  const uint next = take_child(tlas, tlas_node_texels, group);
  stack[depth] = group;
  depth += (group & 0xFFu) != 0u && !done ? 1u : 0u;
  cut_short = cut_short || depth == stack_size;
  return done || cut_short ? ref_none : next;
}

struct Leaf {
  OrientedBox box;
  uint mask;
  uint entity;
};

Leaf fetch_leaf(uint visible, RegionRecord record) {
#ifdef REGION_MOVING
  const uint place = visible + record.instance_base;
  Instance i = fetch_instance(instances, place);
  fetch_instance_box(instances, place, i);
  return Leaf(bounds_at(i, record.t_ns), i.mask, i.entity);
#else
  const int base = int(visible * still_bounds_texels);
  const vec4 t0 = texelFetch(still_bounds, base);
  const vec4 t1 = texelFetch(still_bounds, base + 1);
  const vec4 q = texelFetch(still_bounds, base + 2);
  return Leaf(OrientedBox(t0.xyz, q, t1.xyz), floatBitsToUint(t0.w), floatBitsToUint(t1.w));
#endif
}

bool wants(RegionRecord record, Leaf leaf) {
  bool wanted = (leaf.mask & record.mask) != 0u && leaf.entity != record.excluded;
#ifdef REGION_PAIRS
  wanted = wanted && ((record.flags & region_above_excluded) == 0u || leaf.entity > record.excluded);
#endif
  return wanted;
}

void look_at_border(RegionRecord record, Shape shape, uint base) {
  uint group = 0u;
  if (border_count > 0u) do {
      ++rounds;
      if (border_count > 0u || (group & 0xFFu) != 0u) {
        const bool pop = (group & 0xFFu) == 0u;
        border_count -= pop ? 1u : 0u;
        group = pop ? border_list[border_count] : group;
        const Leaf leaf = fetch_leaf(take_child(tlas, tlas_node_texels, group) & ref_instance_mask, record);
        keep(base, wants(record, leaf) && holds(shape, leaf.box), leaf.entity);
      }
    } while (border_count > 0u || (group & 0xFFu) != 0u);
}

void look_within(RegionRecord record, uint base) {
  uint group = 0u;
  if (within_count > 0u) do {
      ++rounds;
      if (within_count > 0u || (group & 0xFFu) != 0u) {
        const bool pop = (group & 0xFFu) == 0u;
        within_count -= pop ? 1u : 0u;
        group = pop ? within_list[within_count] : group;
        const Leaf leaf = fetch_leaf(take_child(tlas, tlas_node_texels, group) & ref_instance_mask, record);
        keep(base, wants(record, leaf), leaf.entity);
      }
    } while (within_count > 0u || (group & 0xFFu) != 0u);
}

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
#ifdef REGION_LOWEST
  if (counts[index].found <= args.capacity || counts[index].incomplete != 0u) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) return;
#else
  if (skips_when_halted(args.halt, index + args.halt_from)) {
    counts[index] = RegionCount(0u, 0u);  // the pass of the lowest ids skips it
    return;
  }
#endif
  const RegionRecord record = regions[index];
  const Shape shape = shape_of(posed(instances, record), record);
  const uint share = uint(record.share * 256.0 + 0.5);
#ifdef REGION_PAIRS
  const uint base = spaces[index].x;
  space_length = spaces[index].y;
#else
  const uint base = index * args.capacity;
#endif
  uint node = args.root;
  if (node != ref_none) do {
      rounds += 4u;  // this loop's, and one for each of the three inside
      do {
        ++rounds;
        if (node != ref_none) node = visit(node, share, shape);
      } while (node != ref_none && border_count < list_size && within_count < list_size);
      look_at_border(record, shape, base);
      look_within(record, base);
      cut_short = cut_short || rounds > max_rounds;
      node = cut_short ? ref_none : node;
    } while (node != ref_none);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
#ifdef REGION_LOWEST
  // The count is complete already, whatever happens to the list.
  if (cut_short) counts[index].incomplete = 1u;
#else
  counts[index] = RegionCount(found, cut_short ? 1u : 0u);
#endif
}
