#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The search of every nearest query: depth first, the nearest box first, skipping what lies beyond the k-th
// best distance so far. At the leaves of the TLAS, entities have their pose at the query's own time.
// rtstdb/query.hpp defines the fields.
//
// In searches for triangles, one iteration of a loop visits at most one node and at most one leaf. Lanes
// reach leaves at different times, and in a loop over nodes alone most of the cost would be lanes that wait
// for others to reach a leaf.
//
// Macros: LIST_SIZE, the largest k, and one of these:
//   NEAREST_CENTER, NEAREST_BOUNDS   entities by the centre of their bounds, or by the bounds: only the TLAS
//   NEAREST_SURFACE                  entities by their nearest triangle
//   NEAREST_TRIANGLE                 triangles
// NEAREST_STILL, with NEAREST_CENTER: all points have the same time, and the slot's window is that instant.
#if defined(NEAREST_CENTER) || defined(NEAREST_BOUNDS)
#define NEAREST_ENTITY
#endif
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/pairs.glsl"
#include "common/places.glsl"
#include "common/wide_node.glsl"
#include "query/nearest/point.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { NearestArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer tlas;
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2, scalar) readonly buffer PointsBuffer { NearestRecord points[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer CountsBuffer { NearestCount counts[]; };
layout(set = 0, binding = 4) uniform usamplerBuffer identities;
#ifdef NEAREST_STILL
layout(set = 0, binding = 5) uniform samplerBuffer centers;
#endif
#ifndef NEAREST_ENTITY
layout(set = 0, binding = 5) uniform samplerBuffer triangles;
layout(set = 0, binding = 6) uniform usamplerBuffer nodes;
#endif

const float nowhere = 3.4e38;  // farther than anything

uint depth = 0u;

uint rounds = 0u;
bool cut_short = false;

// The search skips what lies beyond `reach`. `box_limit`: its square, enlarged by the rounding error of box
// distances.
float reach;
float box_limit;

void set_reach(float distance) {
  reach = distance;
  box_limit = distance * distance * (1.0 + 2e-6);
}

// ---- the k best so far, in order

// Instances are ordered by entity index, so the instance number decides ties.
struct Candidate {
  float distance;
  uint instance;
  uint triangle;
  uint slot;  // of the triangle in the leaf order
};

#ifdef NEAREST_ENTITY
bool precedes(Candidate a, Candidate b) {
  return a.distance < b.distance || (a.distance == b.distance && a.instance < b.instance);
}

Candidate chosen(bool first, Candidate a, Candidate b) {
  return Candidate(first ? a.distance : b.distance, first ? a.instance : b.instance, 0u, 0u);
}
#else
bool precedes(Candidate a, Candidate b) {
  return a.distance < b.distance ||
         (a.distance == b.distance &&
          (a.instance < b.instance || (a.instance == b.instance && a.triangle < b.triangle)));
}

Candidate chosen(bool first, Candidate a, Candidate b) {
  return Candidate(first ? a.distance : b.distance, first ? a.instance : b.instance,
                   first ? a.triangle : b.triangle, first ? a.slot : b.slot);
}
#endif

// Each insertion moves the whole list by constant indices, so the list stays in registers; a list of variable
// length would be memory that each lane indexes separately. For k below LIST_SIZE, entries with a negative
// distance fill the front.
Candidate list[LIST_SIZE];

void clear_list() {
  [[unroll]] for (uint j = 0u; j < LIST_SIZE; ++j) {
    list[j] = Candidate(j < LIST_SIZE - args.k ? -1.0 : nowhere, no_entity, 0u, 0u);
  }
}

void offer(Candidate candidate) {
  // A candidate out of reach is inserted behind everything.
  const bool in_reach = candidate.distance <= reach;
  candidate.distance = in_reach ? candidate.distance : nowhere;
  candidate.instance = in_reach ? candidate.instance : no_entity;
  // The list is sorted, so the comparisons do not depend on one another; only the moves do.
  Candidate carried = candidate;
  [[unroll]] for (uint j = 0u; j < LIST_SIZE; ++j) {
    const Candidate before = list[j];
    const bool first = precedes(candidate, before);
    list[j] = chosen(first, carried, before);
    carried = chosen(first, before, carried);
  }
  set_reach(min(reach, list[LIST_SIZE - 1u].distance));
}

// ---- boxes

#ifdef NEAREST_ENTITY
bool is_inner(uint reference) { return (reference & ref_leaf_bit) == 0u; }
#else
#include "query/nearest_first.glsl"
#include "query/nearest/geometry.glsl"

// Returns the child whose box is nearest and pushes the others within reach.
uint nearest_entity_child(uint node, float share, vec3 point) {
  const MotionNode wide = fetch_motion_node(tlas, node, share);
  uint nearest = ref_none;
  float nearest_square = 3.4e38;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    precise vec3 lo = child_lo(wide, k);
    precise vec3 hi = child_hi(wide, k);
    offer_child(child_reference(wide, k), box_square(lo, hi, point), nearest, nearest_square);
  }
  return unless_full(nearest);
}
#endif

// ---- leaves

#ifdef NEAREST_STILL
// From the point to the entity's centre. At one instant all instances have one epoch, and `place` is the
// instance itself.
vec3 offset_to_center(uint place, vec3 point) {
  precise vec3 offset = texelFetch(centers, int(place * still_center_texels)).xyz - point;
  return offset;
}
#elif defined(NEAREST_ENTITY)
// From the point to the target, in the world.
vec3 offset_to(Instance i, int t_ns, vec3 point) {
#ifdef NEAREST_CENTER
  precise vec3 offset = bounds_at(i, t_ns).center - point;
  return offset;
#else
  const vec4 q = orientation_of(i, t_ns);
  const vec3 from_center = into_frame(i, q, t_ns, point) - i.box_center * i.scale;
  const vec3 half_extent = i.box_half * i.scale;
  return rotate(q, clamp(from_center, -half_extent, half_extent) - from_center);
#endif
}
#else
void search_triangles(Instance i, uint root, uint place, vec3 point) {
#ifdef NEAREST_SURFACE
  // Only the nearest triangle of the entity is inserted.
  const float reach_before = reach;
  Candidate own = Candidate(reach, no_entity, 0u, 0u);
#endif
  const uint bottom = depth;
  uint current = root;
  if (current != ref_none) do {
      rounds += 3u;  // this loop's, and one for each of the two inside
      if (is_inner(current)) current = nearest_triangle_child(current, i.scale, point);
      const bool is_leaf = current != ref_none && !is_inner(current);
      const uint first = current & ref_triangle_first_mask;
      const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
      uint k = 0u;
      if (is_leaf) do {
          ++rounds;
          if (k < count) {
            uint triangle;
            const float square = nearest_on_slot(first + k, i.scale, point, triangle).square;
            const Candidate candidate = Candidate(sqrt(square), place, triangle, first + k);
#ifdef NEAREST_SURFACE
            const bool better = precedes(candidate, own);
            own.distance = better ? candidate.distance : own.distance;
            own.instance = better ? candidate.instance : own.instance;
            own.triangle = better ? candidate.triangle : own.triangle;
            own.slot = better ? candidate.slot : own.slot;
            set_reach(own.distance);
#else
            offer(candidate);
#endif
            ++k;
          }
        } while (k < count);
      current = is_leaf ? ref_none : current;
      if (current == ref_none) current = next_waiting(bottom);
      cut_short = cut_short || rounds > max_rounds;
    } while (current != ref_none && !cut_short);
#ifdef NEAREST_SURFACE
  set_reach(reach_before);
  if (own.instance != no_entity) offer(own);
#endif
}
#endif

NeighborRecord neighbor_of(uint place, uint slot, float distance, NearestRecord record, QueryPoint query) {
  NeighborRecord neighbor;
#ifdef NEAREST_STILL
  const vec4 velocity_and_entity = texelFetch(centers, int(place * still_center_texels) + 1);
  const uint entity = floatBitsToUint(velocity_and_entity.w);
#else
  Instance i = fetch_instance(instances, place);
  const uint entity = i.entity;
#endif
  const uvec4 identity = texelFetch(identities, int(entity));
  neighbor.entity = identity.xy;
  neighbor.mask = identity.z;
  neighbor.material = identity.w;
  neighbor.has_sign = 0u;
  neighbor.distance_m = distance;
#ifdef NEAREST_ENTITY
#ifdef NEAREST_STILL
  const vec3 offset = offset_to_center(place, query.point);
#else
  fetch_instance_box(instances, place, i);
  const vec3 offset = offset_to(i, record.t_ns, query.point);
#endif
  neighbor.triangle = 0u;
  neighbor.u = neighbor.v = 0.0;
#else
  const vec4 q = orientation_of(i, record.t_ns);
  const vec3 point = into_frame(i, q, record.t_ns, query.point);
  const TrianglePoint nearest = nearest_on_slot(slot, i.scale, point, neighbor.triangle);
  const vec3 offset = rotate(q, nearest.offset);
  neighbor.u = nearest.u;
  neighbor.v = nearest.v;
#endif
  neighbor.p_world_m = query.point + offset;
#ifdef NEAREST_STILL
  const vec3 velocity = velocity_and_entity.xyz;
#elif defined(NEAREST_CENTER)
  const vec3 velocity = center_velocity_at(i, record.t_ns);
#else
  const vec3 velocity = velocity_at(i, record.t_ns, neighbor.p_world_m);
#endif
  neighbor.v_relative_mps = velocity - query.v;
  return neighbor;
}

void store_neighbor(uint place, NeighborRecord neighbor) {
  const Destination to = destination_of(args.neighbors, place, 8u * neighbor_pairs);
  store_pair(to, 0u, neighbor.entity);
  store_pair(to, 1u, uvec2(neighbor.mask, neighbor.material));
  store_pair(to, 2u, uvec2(neighbor.triangle, floatBitsToUint(neighbor.distance_m)));
  store_pair(to, 3u, floatBitsToUint(vec2(neighbor.u, neighbor.v)));
  store_pair(to, 4u, uvec2(neighbor.has_sign, floatBitsToUint(neighbor.p_world_m.x)));
  store_pair(to, 5u, floatBitsToUint(neighbor.p_world_m.yz));
  store_pair(to, 6u, floatBitsToUint(neighbor.v_relative_mps.xy));
  store_pair(to, 7u, uvec2(floatBitsToUint(neighbor.v_relative_mps.z), 0u));
}

#ifdef NEAREST_ENTITY
#include "query/nearest/entities.glsl"
#else
void search_entities(NearestRecord record, vec3 query_point) {
  uint current = args.root;
  if (current != ref_none) do {
      rounds += 3u;  // this loop's, and one for each of the two inside
      if (is_inner(current)) current = nearest_entity_child(current, record.share, query_point);
      if (current != ref_none && !is_inner(current)) {
        const uint place = (current & ref_instance_mask) + record.instance_base;
        Instance i = fetch_instance(instances, place);
        const bool wanted = (i.mask & record.mask) != 0u && (current & ref_instance_mask) != record.excluded;
        const vec3 point = into_frame(i, orientation_of(i, record.t_ns), record.t_ns, query_point);
        search_triangles(i, wanted ? i.blas_root : ref_none, place, point);
        current = ref_none;
      }
      if (current == ref_none) current = next_waiting(0u);
      cut_short = cut_short || rounds > max_rounds;
    } while (current != ref_none && !cut_short);
}
#endif

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) {
    counts[points[index].place] = NearestCount(0u, 0u);  // the sign pass finds no neighbor
    return;
  }
  const NearestRecord record = points[index];
  const QueryPoint query = query_point_of(instances, record);
  set_reach(record.radius_m);
  clear_list();
  search_entities(record, query.point);

  uint found = 0u;
  uint places[LIST_SIZE];
  uint slots[LIST_SIZE];
  float distances[LIST_SIZE];
  [[unroll]] for (uint j = 0u; j < LIST_SIZE; ++j) {
    found += list[j].instance != no_entity && !cut_short ? 1u : 0u;
    places[j] = list[j].instance;
    slots[j] = list[j].slot;
    distances[j] = list[j].distance;
  }
  rounds += found + 1u;
  cut_short = cut_short || rounds > max_rounds;
  uint k = 0u;
  if (found != 0u) do {
      const uint j = LIST_SIZE - args.k + k;
      store_neighbor(record.place * args.k + k,
                     neighbor_of(places[j], slots[j], distances[j], record, query));
      ++k;
    } while (k < found);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  counts[record.place] = NearestCount(cut_short ? 0u : found, cut_short ? 1u : 0u);
}
