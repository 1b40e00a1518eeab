#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The search of regions by triangles: down the TLAS to an entity, then down its geometry by axis-aligned
// boxes in the entity's frame, rotated but not scaled; then the exact test, for triangles that cross the
// region's border. Leaves are collected in lists, as in region_bounds.comp.
//
// Macros: REGION_BOX, REGION_SPHERE or REGION_FRUSTUM; REGION_SURFACE to find entities by their triangles
// instead of triangles; and one of these, or none to list what is found:
//   REGION_LOWEST   for regions that found more than fits: finds the lowest, by a heap
//   REGION_COUNT    counts alone
#define REGION_MOVING
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/packed_edges.glsl"
#include "common/places.glsl"
#include "query/child_group.glsl"
#if defined(REGION_FRUSTUM)
#include "query/region/triangle_in_frustum.glsl"
#elif defined(REGION_SPHERE)
#include "query/region/triangle_in_sphere.glsl"
#else
#include "query/region/triangle_in_box.glsl"
#endif

#ifdef REGION_SURFACE
#define REGION_KEY uint  // entity
#else
#define REGION_KEY uvec2  // entity, triangle
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RegionArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer tlas;
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2) uniform usamplerBuffer nodes;
layout(set = 0, binding = 3) uniform samplerBuffer triangles;
layout(set = 0, binding = 4, scalar) readonly buffer RegionsBuffer { RegionRecord regions[]; };
layout(set = 0, binding = 5, scalar) buffer CountsBuffer { RegionCount counts[]; };
#ifndef REGION_COUNT
layout(set = 0, binding = 6, scalar) buffer IdsBuffer { REGION_KEY ids[]; };
#endif

// Groups of both trees, those of the geometry above those of the TLAS: at most one per level.
const uint stack_size = 96u;
uint stack[stack_size];
uint depth = 0u;

// Groups of leaves of one entity: those to be tested, and those that certainly lie in the region.
const uint list_size = 32u;
uint border_list[list_size];
uint within_list[list_size];
uint border_count = 0u;
uint within_count = 0u;

uint rounds = 0u;
bool cut_short = false;

#include "query/region/keep.glsl"

// An entity at the region's instant.
struct Entity {
  uint id;
  vec3 scale;
  vec3 center;  // of the region, in the entity's frame
  mat3 axes;    // of the region
};

// The next child, of the group or else of those above `bottom` on the stack; ref_none when none is left.
uint next_child(usamplerBuffer of, uint texels, uint group, uint bottom) {
  const bool pop = (group & 0xFFu) == 0u;
  const bool done = pop && depth == bottom;
  depth -= pop && !done ? 1u : 0u;
  group = pop ? stack[depth] : group;
  const uint next = take_child(of, texels, group);
  stack[depth] = group;
  depth += (group & 0xFFu) != 0u && !done ? 1u : 0u;
  cut_short = cut_short || depth == stack_size;
  return done || cut_short ? ref_none : next;
}

bool holds_slot(Shape shape, Entity entity, uint slot, out uint triangle) {
  const int base = int(slot * triangle_texels);
  const vec4 t0 = texelFetch(triangles, base);
  triangle = floatBitsToUint(t0.w);
  const vec3 a = t0.xyz * entity.scale - entity.center;
  const vec3 b = texelFetch(triangles, base + 1).xyz * entity.scale - entity.center;
  const vec3 c = texelFetch(triangles, base + 2).xyz * entity.scale - entity.center;
  return holds_triangle(shape, a * entity.axes, b * entity.axes, c * entity.axes);
}

// The leaf that is tested, and the current triangle in it.
struct Leaf {
  uint group;
  uint slot;
  uint end;
};

// Goes on to the next triangle of the listed groups.
void step_on(inout Leaf leaf, uint listed, bool pop) {
  const bool next_leaf = leaf.slot == leaf.end;
  uint rest = pop ? listed : leaf.group;
  const uint reference = take_child(nodes, node_texels, rest);
  const uint first = reference & ref_triangle_first_mask;
  leaf.group = next_leaf ? rest : leaf.group;
  leaf.slot = next_leaf ? first : leaf.slot;
  leaf.end = next_leaf ? first + (reference >> ref_triangle_count_shift & 0xFu) + 1u : leaf.end;
}

bool needs_group(Leaf leaf) { return leaf.slot == leaf.end && (leaf.group & 0xFFu) == 0u; }

#ifdef REGION_SURFACE

// Whether one triangle has decided about the entity: one that touches, or one that does not lie inside.
bool settled;

// Collects the leaves of a node that cross the border; returns the next node.
uint visit(uint node, Shape shape, Entity entity, uint bottom) {
  const PackedNode packed = fetch_packed_geometry(nodes, node, entity.scale);
  const ChildMasks children = children_near(packed, shape, entity.axes);
  settled = settled || (shape.wants_inside ? packed.used & ~children.meeting : children.within) != 0u;
  const uint border = children.meeting & ~children.within;
  const uint leaves = leaf_mask(fetch_references(nodes, node_texels, node));
  border_list[border_count] = node << 8 | (border & leaves);
  border_count += (border & leaves) != 0u ? 1u : 0u;
  const uint next = next_child(nodes, node_texels, node << 8 | (border & ~leaves), bottom);
  return settled ? ref_none : next;
}

void look_at_border(Shape shape, Entity entity) {
  Leaf leaf = Leaf(0u, 0u, 0u);
  while (!settled && (border_count > 0u || !needs_group(leaf))) {
    ++rounds;
    const bool pop = needs_group(leaf);
    border_count -= pop ? 1u : 0u;
    step_on(leaf, border_list[border_count], pop);
    uint triangle;
    settled = holds_slot(shape, entity, leaf.slot, triangle) != shape.wants_inside;
    ++leaf.slot;
  }
}

void search_geometry(uint root, Shape shape, Entity entity, uint base) {
  const uint bottom = depth;
  uint node = root;
  settled = false;
  while (node != ref_none) {
    rounds += 3u;  // this loop's, and one for each of the two inside
    while (node != ref_none && border_count < list_size) {
      ++rounds;
      node = visit(node, shape, entity, bottom);
    }
    look_at_border(shape, entity);
    cut_short = cut_short || rounds > max_rounds;
    node = cut_short || settled ? ref_none : node;
  }
  border_count = 0u;
  depth = bottom;
  keep(base, root != ref_none && settled != shape.wants_inside, entity.id);
}

#else

// The number of triangles in the leaves of a mask.
uint triangles_of(References references, uint mask) {
  const uvec4 first = (references.first >> ref_triangle_count_shift & 0xFu) + 1u;
  const uvec4 second = (references.second >> ref_triangle_count_shift & 0xFu) + 1u;
  const uvec4 first_bits = uvec4(mask) >> uvec4(0u, 1u, 2u, 3u) & 1u;
  const uvec4 second_bits = uvec4(mask) >> uvec4(4u, 5u, 6u, 7u) & 1u;
  const uvec4 sums = first * first_bits + second * second_bits;
  return sums.x + sums.y + sums.z + sums.w;
}

// Collects the leaves of a node that meet the region; returns the next node.
uint visit(uint node, Shape shape, Entity entity, uint bottom) {
  const PackedNode packed = fetch_packed_geometry(nodes, node, entity.scale);
  const ChildMasks children = children_near(packed, shape, entity.axes);
  const References references = fetch_references(nodes, node_texels, node);
  const uint leaves = leaf_mask(references);
  const uint border_leaves = children.meeting & leaves & ~children.within;
  uint within_leaves = children.meeting & leaves & children.within;
  border_list[border_count] = node << 8 | border_leaves;
  border_count += border_leaves != 0u ? 1u : 0u;
#ifndef REGION_LOWEST
  // Leaves that are not listed are counted at once.
#ifdef REGION_COUNT
  const bool counts_alone = true;
#else
  const bool counts_alone = found >= args.capacity;
#endif
  found += counts_alone ? triangles_of(references, within_leaves) : 0u;
  within_leaves = counts_alone ? 0u : within_leaves;
#endif
  within_list[within_count] = node << 8 | within_leaves;
  within_count += within_leaves != 0u ? 1u : 0u;
  return next_child(nodes, node_texels, node << 8 | (children.meeting & ~leaves), bottom);
}

void look_at_border(Shape shape, Entity entity, uint base) {
  Leaf leaf = Leaf(0u, 0u, 0u);
  while (border_count > 0u || !needs_group(leaf)) {
    ++rounds;
    const bool pop = needs_group(leaf);
    border_count -= pop ? 1u : 0u;
    step_on(leaf, border_list[border_count], pop);
    uint triangle;
    const bool holds = holds_slot(shape, entity, leaf.slot, triangle);
    keep(base, holds, uvec2(entity.id, triangle));
    ++leaf.slot;
  }
}

void look_within(Entity entity, uint base) {
  Leaf leaf = Leaf(0u, 0u, 0u);
  while (within_count > 0u || !needs_group(leaf)) {
    ++rounds;
    const bool pop = needs_group(leaf);
    within_count -= pop ? 1u : 0u;
    step_on(leaf, within_list[within_count], pop);
    keep(base, true,
         uvec2(entity.id, floatBitsToUint(texelFetch(triangles, int(leaf.slot * triangle_texels)).w)));
    ++leaf.slot;
  }
}

void search_geometry(uint root, Shape shape, Entity entity, uint base) {
  const uint bottom = depth;
  uint node = root;
#ifdef REGION_LOWEST
  // None of its triangles is among the lowest.
  node = found >= args.capacity && entity.id > ids[base].x ? ref_none : node;
#endif
  while (node != ref_none) {
    rounds += 4u;  // this loop's, and one for each of the three inside
    while (node != ref_none && border_count < list_size && within_count < list_size) {
      ++rounds;
      node = visit(node, shape, entity, bottom);
    }
    look_at_border(shape, entity, base);
    look_within(entity, base);
    cut_short = cut_short || rounds > max_rounds;
    node = cut_short ? ref_none : node;
  }
  depth = bottom;
}

#endif

void search_entities(RegionRecord record, uint base) {
  const OrientedBox at = posed(instances, record);
  const Shape in_world = shape_of(at, record);
  const uint share = uint(record.share * 256.0 + 0.5);
  uint current = args.root;
  while (current != ref_none) {
    // This loop's, and one for each of the two inside.
    rounds += 3u;
    while ((current & ref_leaf_bit) == 0u) {
      ++rounds;
      const PackedNode packed = fetch_packed_node(tlas, current, share);
      current = next_child(tlas, tlas_node_texels, current << 8 | children_of(packed, in_world).meeting, 0u);
    }
    const bool is_entity = current != ref_none;
    const Instance i =
        fetch_instance(instances, is_entity ? (current & ref_instance_mask) + record.instance_base : 0u);
    const vec4 to_own = conjugate(orientation_of(i, record.t_ns));
    const OrientedBox own = OrientedBox(rotate(to_own, at.center - position_of(i, record.t_ns)),
                                        normalize(quat_product(to_own, at.q)), at.half_extent);
    const bool wanted = is_entity && (i.mask & record.mask) != 0u;
    search_geometry(wanted ? i.blas_root : ref_none, shape_of(own, record),
                    Entity(i.entity, i.scale, own.center, axes_of(own.q)), base);
    current = next_child(tlas, tlas_node_texels, 0u, 0u);
    cut_short = cut_short || rounds > max_rounds;
    current = is_entity && !cut_short ? current : ref_none;
  }
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
  search_entities(regions[index], index * args.capacity);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
#ifdef REGION_LOWEST
  // The count is complete already; this pass skips entities.
  if (cut_short) counts[index].incomplete = 1u;
#else
  counts[index] = RegionCount(found, cut_short ? 1u : 0u);
#endif
}
