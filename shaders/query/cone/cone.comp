#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Cone queries: the search for the first contacts of a cone with entities. Depth first, the nearest box
// first, skipping what lies beyond the last entity of the list. rtstdb/query.hpp defines the fields.
//
// Macros: LIST_SIZE: the largest number of entities; CONE_CONTACTS: writes contacts instead of returns, for
// cone_fractions.comp; CONE_FAST: uses the distance fields of geometries.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/cone.h"
#include "shared/query.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ConeArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer tlas;
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2, scalar) readonly buffer ConesBuffer { ConeRecord cones[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer CountsBuffer { ConeCount counts[]; };
layout(set = 0, binding = 4) uniform usamplerBuffer identities;
layout(set = 0, binding = 5) uniform samplerBuffer triangles;
layout(set = 0, binding = 6) uniform usamplerBuffer nodes;
#ifdef CONE_FAST
layout(set = 0, binding = 7) uniform usamplerBuffer fields;
#endif

uint depth = 0u;
uint rounds = 0u;
bool cut_short = false;
float box_limit;  // in metres along the axis
#include "query/cone/cone.glsl"
#include "query/cone/returns.glsl"
#include "query/cone/children.glsl"

#ifdef CONE_CONTACTS
layout(buffer_reference, buffer_reference_align = 4, scalar) writeonly buffer Contacts {
  ConeContact contacts[];
};
#endif

// The lambda beyond which contacts are skipped. box_limit is the same along the axis, and covers rounding.
float reach;

void set_reach(float lambda, float m_per_lambda) {
  reach = lambda;
  box_limit = lambda < 1e37 ? lambda * m_per_lambda * (1.0 + 4e-6) + 1e-37 : nowhere * 0.99;
}

// ---- the first entities so far, in order

// Instances are ordered by entity index, so the instance number decides ties.
struct Candidate {
  float lambda;
  uint instance;
  uint triangle;
  uint slot;  // of the triangle in the leaf order
};

bool precedes(Candidate a, Candidate b) {
  return a.lambda < b.lambda ||
         (a.lambda == b.lambda &&
          (a.instance < b.instance || (a.instance == b.instance && a.triangle < b.triangle)));
}

Candidate chosen(bool first, Candidate a, Candidate b) {
  return Candidate(first ? a.lambda : b.lambda, first ? a.instance : b.instance,
                   first ? a.triangle : b.triangle, first ? a.slot : b.slot);
}

// For fewer entities than LIST_SIZE, entries with a negative lambda fill the front (nearest.comp).
Candidate list[LIST_SIZE];

void clear_list() {
  [[unroll]] for (uint j = 0u; j < LIST_SIZE; ++j) {
    list[j] = Candidate(j < LIST_SIZE - args.entities ? -1.0 : nowhere, no_entity, 0u, 0u);
  }
}

void insert(Candidate candidate) {
  Candidate carried = candidate;
  [[unroll]] for (uint j = 0u; j < LIST_SIZE; ++j) {
    const Candidate before = list[j];
    const bool first = precedes(candidate, before);
    list[j] = chosen(first, carried, before);
    carried = chosen(first, before, carried);
  }
}

// ---- both trees

// Returns the child whose bound is least and pushes the others within reach.
uint nearest_entity_child(uint node, TracedCone cone) {
  const MotionNode wide = fetch_entity_node(tlas, node, cone);
  uint nearest = ref_none;
  float nearest_bound = nowhere;
  [[unroll]] for (uint k = 0u; k < 8u; ++k)
      offer_child(child_reference(wide, k), entity_child_bound(cone.slopes, wide, k), nearest, nearest_bound);
  return unless_full(nearest);
}

// Inserts the first contact with one entity within reach, with `slot_bit` set in its slot. Returns whether
// there is one.
bool search_triangles(ConeInFrame there, TracedCone cone, uint root, uint place, uint slot_bit) {
  const float reach_before = reach;
  Candidate first_of_entity = Candidate(nowhere, no_entity, 0u, 0u);
  const uint bottom = depth;
  uint current = root;
  if (current != ref_none) do {
      rounds += 3u;  // this loop's, and one for each of the two inside
      if (is_inner(current)) current = nearest_triangle_child(current, there);
      const bool is_leaf = current != ref_none && !is_inner(current);
      const uint first = current & ref_triangle_first_mask;
      const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
      uint k = 0u;
      if (is_leaf) do {
          // Boxes of triangles first: the contact with a triangle costs ten times as much as its box.
          bool is_near = false;
          do {
            ++rounds;
            const int base = int((first + min(k, count - 1u)) * triangle_texels);
            is_near = k < count && triangle_bound(there, texelFetch(triangles, base).xyz,
                                                  texelFetch(triangles, base + 1).xyz,
                                                  texelFetch(triangles, base + 2).xyz) <= box_limit;
            k += is_near ? 0u : 1u;
          } while (!is_near && k < count);
          ++rounds;
          if (is_near) {
            const TriangleContact contact = contact_with(there, cone, first + k);
            const Candidate candidate =
                Candidate(contact.lambda, place, fetch_corners(first + k).triangle, first + k | slot_bit);
            const bool better =
                contact.found && contact.lambda <= reach && precedes(candidate, first_of_entity);
            first_of_entity = chosen(better, candidate, first_of_entity);
            set_reach(min(reach, first_of_entity.lambda), cone.m_per_lambda);
            ++k;
          }
        } while (k < count);
      current = is_leaf ? ref_none : current;
      if (current == ref_none) current = next_waiting(bottom);
      cut_short = cut_short || rounds > max_rounds;
    } while (current != ref_none && !cut_short);
  const bool found = first_of_entity.instance != no_entity;
  if (found) insert(first_of_entity);
  set_reach(min(reach_before, list[LIST_SIZE - 1u].lambda), cone.m_per_lambda);
  return found;
}

#ifdef CONE_FAST
#include "query/cone/by_field.glsl"

// Searches one entity, if it is `wanted`: its triangles in windows of the axis where the distance field shows
// no free space.
void search_entity(TracedCone cone, Instance i, bool wanted, uint place) {
  ConeInFrame there = enter_instance(cone, i, head_of(i.blas_root));
  const uint texel = field_of_instance(instances, place);
  const bool has_field = texel != field_none && is_narrow(cone.angle);
  FieldMarch march = begin_march(there, cone, has_field, texel);
  march.is_settled = march.is_settled || !wanted;
  if (!march.is_settled) do {
      ++rounds;
      step_along(there, cone.angle, march);
      const bool searches = march.is_near && !march.is_settled;
      const float reach_before = reach;
      const float end = march.free + march.window;
      if (searches) {
        there.from = march.free;
        set_reach(min(reach, end / cone.m_per_lambda), cone.m_per_lambda);
      }
      const bool found = search_triangles(there, cone, searches ? i.blas_root : ref_none, place,
                                          has_field ? contact_by_field_bit : 0u);
      if (searches) {
        set_reach(min(reach_before, list[LIST_SIZE - 1u].lambda), cone.m_per_lambda);
        march.free = end;
        march.window *= 2.0;
        march.is_settled = found || end > box_limit || end > march.last || !has_field;
      }
      cut_short = cut_short || rounds > max_rounds;
    } while (!march.is_settled && !cut_short);
}
#else
void search_entity(TracedCone cone, Instance i, bool wanted, uint place) {
  search_triangles(enter_instance(cone, i, head_of(i.blas_root)), cone, wanted ? i.blas_root : ref_none,
                   place, 0u);
}
#endif

void search_entities(TracedCone cone) {
  uint current = args.root;
  if (current != ref_none) do {
      rounds += 3u;  // this loop's, and one for each of the two inside
      if (is_inner(current)) current = nearest_entity_child(current, cone);
      if (current != ref_none && !is_inner(current)) {
        const uint place = (current & ref_instance_mask) + cone.axis.instance_base;
        const Instance i = fetch_instance(instances, place);
        const bool wanted = (i.mask & cone.axis.mask) != 0u;
        search_entity(cone, i, wanted, place);
        current = ref_none;
      }
      if (current == ref_none) current = next_waiting(0u);
      cut_short = cut_short || rounds > max_rounds;
    } while (current != ref_none && !cut_short);
}

void write_answer(TracedCone cone, uint place, uint found) {
  uint found_places[LIST_SIZE];
  uint slots[LIST_SIZE];
  float lambdas[LIST_SIZE];
  [[unroll]] for (uint j = 0u; j < LIST_SIZE; ++j) {
    found_places[j] = list[j].instance;
    slots[j] = list[j].slot;
    lambdas[j] = list[j].lambda;
  }
  uint k = 0u;
#ifdef CONE_CONTACTS
  if (found != 0u) do {
      const uint j = LIST_SIZE - args.entities + k;
      Contacts(args.contacts).contacts[place * beam_contacts + k] =
          ConeContact(found_places[j], slots[j], lambdas[j]);
      ++k;
    } while (k < found);
#else
  do {
    const uint j = LIST_SIZE - args.entities + k;
    const bool is_found = k < found;
    if (is_found) {
      const ConeContact contact = ConeContact(found_places[j], slots[j], lambdas[j]);
      write_return(place * args.returns_per_cone + k, cone, full_contact(cone, contact), 0.0, false);
    } else {
      write_no_return(place * args.returns_per_cone + k, cut_short ? status_incomplete : status_miss, false);
    }
    ++k;
  } while (k < args.returns_per_cone);
#endif
}

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  const ConeRecord record = cones[index];
  if (skips_when_halted(args.halt, index + args.halt_from)) {
    counts[record.place] = ConeCount(0u, 0u, 0u);
    return;
  }
  const TracedCone cone = traced_cone(record);
  set_reach(cone.axis.lambda_max, cone.m_per_lambda);
  clear_list();
  search_entities(cone);

  uint found = 0u;
  [[unroll]] for (uint j = 0u; j < LIST_SIZE; ++j) found += list[j].instance != no_entity ? 1u : 0u;
  rounds += args.entities + 1u;
  cut_short = cut_short || rounds > max_rounds || !loops_still_turn(args.loop_probe);
  found = cut_short ? 0u : found;
  write_answer(cone, record.place, found);
  const bool incomplete = cut_short || !loops_still_turn(args.loop_probe);
  counts[record.place] = ConeCount(found, incomplete ? 1u : 0u, 0u);
}
