#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The returns of a cone with the fraction of the beam that reaches each entity past all nearer ones. A
// workgroup for each cone; cone.comp has found the entities.
//
// The area A that an entity's triangles cover in the beam is exact. Its visible part is estimated along a
// fixed pattern of directions: these meet S layers of the entity, V of which are the nearest surface. The
// fraction is A V / S, but at most what V directions may see. If no direction meets the entity, the fraction
// is A or 0, depending on whether its contact is visible from the apex. So a partly covered beam has an exact
// fraction, and an entity smaller than the pattern resolves is not lost
// (docs/decisions/0042-fractions-of-a-beam.md).
//
// Each of the first 64 lanes searches a direction, each of the next 16 the line to a contact. For areas every
// lane measures a triangle.
//
// Macro: CONE_FAST: along each direction only the nearest surface is searched. An entity that enough of them
// meet has their share, and so has one that some meet and that has too many triangles in the beam. The others
// are measured as above.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/cone.h"
#include "shared/query.h"

const uint lanes = beam_directions + beam_entities;
layout(local_size_x = 80) in;
layout(push_constant, scalar) uniform Push { ConeArgs args; };
layout(set = 0, binding = 0) uniform samplerBuffer instances;
layout(set = 0, binding = 1, scalar) readonly buffer ConesBuffer { ConeRecord cones[]; };
layout(set = 0, binding = 2, scalar) buffer CountsBuffer { ConeCount counts[]; };
layout(set = 0, binding = 3) uniform usamplerBuffer identities;
layout(set = 0, binding = 4) uniform samplerBuffer triangles;
layout(set = 0, binding = 5) uniform usamplerBuffer nodes;

layout(buffer_reference, buffer_reference_align = 4, scalar) readonly buffer Contacts {
  ConeContact contacts[];
};

#include "query/cone/cone.glsl"
#include "query/cone/covered_area.glsl"
#include "query/cone/returns.glsl"

shared float areas[beam_entities * lanes];
shared uint layers[beam_entities];
shared uint nearest_in[beam_entities];  // directions
shared float shares[beam_entities];
shared uint visible[beam_entities];  // its contact, from the apex
shared uint is_halted;
shared uint some_cut_short;
shared uint some_reach_beyond;  // directions: the farthest entity that was searched

uint depth = 0u;
uint rounds = 0u;
bool cut_short = false;
float box_limit;  // in metres along the axis
#include "query/cone/children.glsl"

// More rounds than the loops after the search need.
const uint rounds_at_end = 400u;

const uint enough_directions = 8u;
const uint max_measured_triangles = 6u * lanes;
const uint any_number = 0xFFFFFFFFu;
const float not_measured = -1.0;

// A beam with a smaller sine is thinner than the rounding of positions; it is treated as a ray.
const float min_beam_sine = 1e-6;

// The part of the beam that this many directions of the pattern see is hardly larger than this.
float largest_share(uint directions) {
  const float count = float(int(directions));
  return (count + sqrt(count) + 1.5) / float(int(beam_directions));
}

// A direction from the apex: the points with (x, y) upright = z towards.
struct Direction {
  float upright;
  vec2 towards;
};

// Spread evenly over the beam's cross-section: a spiral of equal areas (Vogel 1979).
Direction pattern_direction(uint k, HalfAngle angle) {
  const float turn = float(int(k)) * 2.3999632;
  const float radius = sqrt((float(int(k)) + 0.5) / float(int(beam_directions)));
  return Direction(angle.cosine, angle.sine * radius * vec2(cos(turn), sin(turn)));
}

Direction direction_to(vec3 point) { return Direction(1.0, point.z > 0.0 ? point.xy / point.z : vec2(0.0)); }

// Whether a triangle covers a part of the beam: it has an area, and `faces` permits the side that it shows.
// `a`: its first corner in the cone's coordinates.
bool is_counted(ConeInFrame there, Corners corners, vec3 a) {
  const vec3 n = cross(step_in_cone(there, corners.a, corners.b), step_in_cone(there, corners.a, corners.c));
  return corners.has_area && -dot(n, a) * args.faces >= 0.0;
}

// The z at which a direction meets a triangle, decided as for a ray (test_corners); `nowhere`: it does not.
float meets_at(Direction along, vec3 a, vec3 b, vec3 c, float z_max) {
  precise vec2 a2 = along.upright * a.xy - along.towards * a.z;
  precise vec2 b2 = along.upright * b.xy - along.towards * b.z;
  precise vec2 c2 = along.upright * c.xy - along.towards * c.z;
  const float wa = edge_function(c2, b2);
  const float wb = edge_function(a2, c2);
  const float wc = edge_function(b2, a2);
  const bool inside =
      ((wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0)) && !beside(a2, b2, c2);
  const float sum = wa + wb + wc;
  const float z = (wa * a.z + wb * b.z + wc * c.z) / (sum == 0.0 ? 1.0 : sum);
  return inside && sum != 0.0 && z > 0.0 && z <= z_max ? z : nowhere;
}

// What a lane has found along its direction so far.
struct DirectionState {
  float z;  // the nearest surface
  uint entity;
  uint instance;
  uint layers;  // of the entity that is searched
};

// All lanes visit the same nodes and leaves. Each of four lanes handles one child of a node or one triangle
// of a leaf for the whole subgroup, which has at least four lanes.
const uint at_once = 4u;

// Pushes the children of a node that the cone meets.
void push_children(uint node, ConeInFrame there, float z_max) {
  const WideNode wide = fetch_geometry_node(nodes, node, there);
  uint children = 0u;
  [[unroll]] for (uint first = 0u; first < node_width; first += at_once) {
    const uint k = first + gl_SubgroupInvocationID % at_once;
    const bool meets = child_reference(wide, k) != ref_none && geometry_child_bound(there, wide, k) <= z_max;
    children |= (subgroupBallot(meets).x & 0xFu) << first;
  }
  [[unroll]] for (uint k = 0u; k < node_width; ++k) {
    stack_ref[depth] = child_reference(wide, k);
    depth += children >> k & 1u;
  }
  cut_short = cut_short || depth > stack_limit;
}

// Tests this lane's direction against the triangles of a leaf, `count` from `first` on.
void test_leaf(uint first, uint count, ConeInFrame there, uint entity, uint instance, Direction along,
               float z_max, inout DirectionState state) {
  const uint turn = gl_SubgroupInvocationID % at_once;
  const Corners corners = fetch_corners(first + min(turn, count - 1u));
  const vec3 a = in_cone(there, corners.a);
  const vec3 b = in_cone(there, corners.b);
  const vec3 c = in_cone(there, corners.c);
  const bool counts = turn < count && is_counted(there, corners, a);
  [[unroll]] for (uint k = 0u; k < at_once; ++k) {
    const float z =
        meets_at(along, subgroupShuffle(a, k), subgroupShuffle(b, k), subgroupShuffle(c, k), z_max);
    const bool meets = subgroupShuffle(counts, k) && z < nowhere;
    const bool nearer = meets && (z < state.z || (z == state.z && instance < state.instance));
    state.layers += meets ? 1u : 0u;
    state.z = nearer ? z : state.z;
    state.entity = nearer ? entity : state.entity;
    state.instance = nearer ? instance : state.instance;
  }
}

#ifdef CONE_FAST

// What the tests of boxes need of a direction: its point with z = 1, and the axis of the cone.
ConeSlopes slopes_along(ConeInFrame there, Direction along) {
  const vec3 towards = vec3(along.towards / along.upright, 1.0) * there.to_cone;
  const vec3 margin = 2e-6 * (abs(there.slopes.axis) + abs(towards));
  return ConeSlopes(there.slopes.axis, inverse_direction(towards + margin),
                    inverse_direction(towards - margin));
}

// Searches the nearest surface of an entity along this lane's direction.
void search_direction(TracedCone cone, uint entity, ConeContact contact, Direction along, float z_max,
                      inout DirectionState state) {
  const Instance i = fetch_instance(instances, contact.instance);
  ConeInFrame there = enter_instance(cone, i, head_of(i.blas_root));
  there.slopes = slopes_along(there, along);
  depth = 0u;
  uint current = i.blas_root;
  do {
    rounds += 3u;  // this loop's, and one for each of the two inside
    // Also covers rounding.
    box_limit = min(state.z, z_max) * (1.0 + 4e-6);
    if (is_inner(current)) current = nearest_triangle_child(current, there);
    const bool is_leaf = current != ref_none && !is_inner(current);
    const uint first = current & ref_triangle_first_mask;
    const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
    uint k = 0u;
    if (is_leaf) do {
        ++rounds;
        const Corners corners = fetch_corners(first + k);
        const vec3 a = in_cone(there, corners.a);
        const float z = meets_at(along, a, in_cone(there, corners.b), in_cone(there, corners.c), z_max);
        const bool meets = z < nowhere && is_counted(there, corners, a);
        const bool nearer = meets && (z < state.z || (z == state.z && contact.instance < state.instance));
        state.z = nearer ? z : state.z;
        state.entity = nearer ? entity : state.entity;
        state.instance = nearer ? contact.instance : state.instance;
        ++k;
      } while (k < count);
    current = is_leaf ? ref_none : current;
    if (current == ref_none) current = next_waiting(0u);
    cut_short = cut_short || rounds > max_rounds - rounds_at_end;
  } while (current != ref_none && !cut_short);
}
#endif

// The area of a triangle in the beam; 0 for ref_none.
float area_of(uint slot, TracedCone cone, ConeInFrame there, float z_max) {
  const Corners corners = fetch_corners(slot != ref_none ? slot : 0u);
  const vec3 a = in_cone(there, corners.a);
  const float area = covered_area(a, step_in_cone(there, corners.a, corners.b),
                                  step_in_cone(there, corners.a, corners.c), cone.angle, z_max);
  return slot != ref_none && is_counted(there, corners, a) ? area : 0.0;
}

// Searches the triangles of an entity in the cone. Returns the area of those that this lane has measured, or
// not_measured if there are more than `max_triangles`.
float search_entity(TracedCone cone, uint entity, ConeContact contact, uint max_triangles, Direction along,
                    float z_max, inout DirectionState state) {
  const Instance i = fetch_instance(instances, contact.instance);
  const ConeInFrame there = enter_instance(cone, i, head_of(i.blas_root));
  state.layers = 0u;
  depth = 0u;
  stack_ref[depth++] = i.blas_root;
  float area = 0.0;
  uint measured = 0u;
  do {
    ++rounds;
    // Collects a triangle for every lane.
    uint measured_slot = ref_none;
    uint seen = 0u;
    do {
      ++rounds;
      const uint current = stack_ref[--depth];
      const bool is_leaf = !is_inner(current);
      const uint first = is_leaf ? current & ref_triangle_first_mask : 0u;
      const uint count = is_leaf ? (current >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
      const uint turn = gl_LocalInvocationID.x - seen;
      measured_slot = turn < count ? first + turn : measured_slot;
      seen += count;
      if (is_leaf) {
        test_leaf(first, count, there, entity, contact.instance, along, z_max, state);
      } else {
        push_children(current, there, z_max);
      }
      cut_short = cut_short || rounds > max_rounds - rounds_at_end;
    } while (seen + max_triangles_per_leaf <= lanes && depth > 0u && !cut_short);
    area += area_of(measured_slot, cone, there, z_max);
    measured += seen;
  } while (depth > 0u && measured <= max_triangles && !cut_short);
  return depth > 0u ? not_measured : area;
}

// Measures the area of an entity in the cone and counts its layers along the directions.
void measure(TracedCone cone, uint entity, ConeContact contact, uint max_triangles, Direction along,
             float z_max, inout DirectionState state) {
  const uint lane = gl_LocalInvocationID.x;
  areas[entity * lanes + lane] = search_entity(cone, entity, contact, max_triangles, along, z_max, state);
  if (lane < beam_directions && state.layers > 0u) atomicAdd(layers[entity], state.layers);
}

// The part of the beam that reaches an entity. `of`: its contact.
float share_of(uint entity, FullContact of, bool is_visible) {
  float area = 0.0;
  for (uint lane = 0u; lane < lanes; ++lane) area += areas[entity * lanes + lane];
  area *= 0.31830989;  // 1 / pi
  const uint all = layers[entity];
  const uint nearest = nearest_in[entity];
#ifdef CONE_FAST
  if (nearest >= enough_directions || area < 0.0) return float(int(nearest)) / float(int(beam_directions));
#endif
  // Fronts and backs of a closed geometry cover the same part of the beam.
  const bool twice = of.instance.closed && args.faces == 0.0;
  const float unmet = is_visible ? area * (twice ? 0.5 : 1.0) : 0.0;
  const float estimated = area * float(int(nearest)) / float(int(max(all, 1u)));
  return min(all == 0u ? unmet : estimated, largest_share(nearest));
}

void main() {
  const uint index = args.first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x);
  const uint lane = gl_LocalInvocationID.x;
  if (lane == 0u) {
    is_halted = index < args.end && skips_when_halted(args.halt, index + args.halt_from) ? 1u : 0u;
    some_cut_short = some_reach_beyond = 0u;
  }
  if (lane < beam_entities) {
    layers[lane] = nearest_in[lane] = 0u;
    shares[lane] = 0.0;
  }
  barrier();
  if (index >= args.end || is_halted != 0u) return;

  const ConeRecord record = cones[index];
  const ConeCount count = counts[record.place];
  const TracedCone cone = traced_cone(record);
  Contacts found = Contacts(args.contacts);
  const uint first_contact = record.place * beam_contacts;
  const uint entities = min(count.found, beam_entities);
  const bool is_beam = cone.angle.sine > min_beam_sine;
  const float z_max = min(cone.axis.lambda_max * cone.m_per_lambda, 1e30);

  const bool is_contact = lane >= beam_directions && lane - beam_directions < entities;
  const uint contact_index = is_contact ? lane - beam_directions : 0u;
  FullContact contact;
  contact.point = vec3(0.0);
  if (count.found > 0u) contact = full_contact(cone, found.contacts[first_contact + contact_index]);
  Direction along = pattern_direction(lane, cone.angle);
  if (is_contact) along = direction_to(contact.point);

  DirectionState state = DirectionState(nowhere, no_entity, no_entity, 0u);
  bool is_visible = true;
  uint entity = 0u;
  if (is_beam && entities > 0u) do {
      ++rounds;
      const DirectionState before = state;
      const ConeContact searched = found.contacts[first_contact + entity];
#ifdef CONE_FAST
      search_direction(cone, entity, searched, along, z_max, state);
#else
      measure(cone, entity, searched, any_number, along, z_max, state);
#endif
      // A contact does not hide itself.
      if (is_contact && entity == contact_index) state = before;
      ++entity;
    } while (entity < entities);
  // In front by more than rounding.
  if (is_contact) {
    is_visible = state.z >= contact.point.z * (1.0 - 1e-6);
    visible[contact_index] = is_visible ? 1u : 0u;
  }
  if (lane < beam_directions && state.entity != no_entity) atomicAdd(nearest_in[state.entity], 1u);
#ifdef CONE_FAST
  barrier();
  entity = 0u;
  if (is_beam && entities > 0u) do {
      ++rounds;
      DirectionState others = state;
      const uint directions = nearest_in[entity];
      const uint max_triangles = directions == 0u ? any_number : max_measured_triangles;
      if (directions == 0u ? visible[entity] != 0u : directions < enough_directions)
        measure(cone, entity, found.contacts[first_contact + entity], max_triangles, along, z_max, others);
      ++entity;
    } while (entity < entities);
#endif
  if (count.found > beam_entities && lane < beam_directions && is_beam) {
    const float beyond = found.contacts[first_contact + beam_entities].lambda * cone.m_per_lambda;
    if (state.z > beyond * (1.0 - 1e-6)) atomicOr(some_reach_beyond, 1u);
  }
  if (cut_short || count.incomplete != 0u || !loops_still_turn(args.loop_probe)) atomicOr(some_cut_short, 1u);
  barrier();

  if (is_contact)
    shares[contact_index] = is_beam               ? share_of(contact_index, contact, is_visible)
                            : contact_index == 0u ? 1.0
                                                  : 0.0;
  barrier();

  float total = 0.0;
  uint returns = 0u;
  uint rank = 0u;
  for (uint k = 0u; k < beam_entities; ++k) {
    const bool reached = shares[k] > 0.0;
    total += shares[k];
    rank += reached && k < contact_index ? 1u : 0u;
    returns += reached ? 1u : 0u;
  }
  const bool incomplete = some_cut_short != 0u || !loops_still_turn(args.loop_probe);
  const bool overflow = some_reach_beyond != 0u;
  returns = incomplete ? 0u : returns;
  const uint first_return = record.place * args.returns_per_cone;
  if (is_contact && !incomplete && shares[contact_index] > 0.0 && rank < args.returns_per_cone)
    write_return(first_return + rank, cone, contact, shares[contact_index] / max(total, 1.0), overflow);
  if (lane < args.returns_per_cone && lane >= returns)
    write_no_return(first_return + lane, incomplete ? status_incomplete : status_miss, overflow);
  if (lane == 0u) counts[record.place] = ConeCount(count.found, incomplete ? 1u : 0u, overflow ? 1u : 0u);
}
