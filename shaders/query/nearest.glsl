// The search of every nearest query: down the nearest box first, passing over what lies beyond the k-th best so far. At the
// leaves of the TLAS stands the entity at the query's own instant. See rtstdb/query.hpp for what the fields mean.
//
// Include with one of these defined:
//   NEAREST_CENTER, NEAREST_BOUNDS   entities by the centre of their bounds, or by the bounds; only the TLAS is searched
//   NEAREST_SURFACE                  entities by their nearest triangle
//   NEAREST_TRIANGLE                 triangles
//   NEAREST_ONE                      the one nearest triangle, which is also the one nearest surface
#include "common/interleave.glsl"
#include "common/loops.glsl"
#include "query/nearest_node.glsl"
#include "query/nearest_point.glsl"

#if defined(NEAREST_CENTER) || defined(NEAREST_BOUNDS)
#define NEAREST_ENTITY
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { NearestArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
#ifndef NEAREST_ENTITY
layout(set = 0, binding = 5) uniform samplerBuffer triangles;
#endif
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2, scalar) readonly buffer PointsBuffer { NearestRecord points[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer CountsBuffer { NearestCount counts[]; };
layout(set = 0, binding = 4, scalar) writeonly buffer NeighborsBuffer { NeighborRecord neighbors[]; };

const uint stack_size = 128u;
// Every inner node pushes at most 7 references.
const uint stack_limit = stack_size - 8u;
uint stack_ref[stack_size];
float stack_square[stack_size];
uint depth = 0u;

uint rounds = 0u;

// ---- what was found so far

struct Candidate {
  float distance;
  uint entity;
  uint triangle;
  uint instance;
  uint slot;  // of the triangle in the leaf order
};

bool precedes(Candidate a, Candidate b) {
  return a.distance < b.distance ||
         (a.distance == b.distance && (a.entity < b.entity || (a.entity == b.entity && a.triangle < b.triangle)));
}

// Nothing beyond `reach` matters any more; for boxes, squared and with what rounding may take from a box's distance.
float reach;
float box_limit;

void set_reach(float distance) {
  reach = distance;
  box_limit = distance * distance * (1.0 + 1e-6);
}

#ifdef NEAREST_ONE
Candidate best;
uint found = 0u;

void offer(Candidate candidate) {
  const bool better = candidate.distance <= reach && (found == 0u || precedes(candidate, best));
  best.distance = better ? candidate.distance : best.distance;
  best.entity = better ? candidate.entity : best.entity;
  best.triangle = better ? candidate.triangle : best.triangle;
  best.instance = better ? candidate.instance : best.instance;
  best.slot = better ? candidate.slot : best.slot;
  found = better ? 1u : found;
  set_reach(better ? candidate.distance : reach);
}

Candidate listed(uint place) { return best; }
#else
// In order.
Candidate list[list_size];
uint found = 0u;

Candidate listed(uint place) { return list[place]; }

void offer(Candidate candidate) {
  const bool full = found == args.k;
  const bool better = candidate.distance <= reach && (!full || precedes(candidate, list[args.k - 1u]));
  ++rounds;  // the loop's, also where it has none
  if (!better) return;
  uint place = full ? found - 1u : found;
  while (place > 0u && precedes(candidate, list[place - 1u])) {
    ++rounds;
    list[place] = list[place - 1u];
    --place;
  }
  list[place] = candidate;
  found = full ? found : found + 1u;
  set_reach(found == args.k ? list[args.k - 1u].distance : reach);
}
#endif

// ---- boxes

float box_square(vec3 lo, vec3 hi, vec3 point) {
  precise vec3 below = lo - point;
  precise vec3 above = point - hi;
  const vec3 gap = max(max(below, above), vec3(0.0));
  return dot(gap, gap);
}

// The child whose box is nearest, stretched by `scale`; the others that are in reach wait on the stack.
uint nearest_child(uint node, vec3 scale, vec3 point) {
  const WideNode wide = fetch_wide_node(nodes, node);
  uint nearest = ref_none;
  float nearest_square = 3.4e38;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint ref = child_reference(wide, k);
    precise vec3 lo = child_lo(wide, k) * scale;
    precise vec3 hi = child_hi(wide, k) * scale;
    const float square = box_square(lo, hi, point);
    const bool in_reach = square <= box_limit && ref != ref_none;
    const bool nearer = in_reach && square < nearest_square;
    stack_ref[depth] = nearer ? nearest : ref;
    stack_square[depth] = nearer ? nearest_square : square;
    depth += (nearer ? nearest != ref_none : in_reach) ? 1u : 0u;
    nearest = nearer ? ref : nearest;
    nearest_square = nearer ? square : nearest_square;
  }
  return nearest;
}

// What waits above `bottom` and is still in reach, or none.
uint next_waiting(uint bottom) {
  uint next = ref_none;
  while (next == ref_none && depth > bottom) {
    ++rounds;
    --depth;
    next = stack_square[depth] <= box_limit ? stack_ref[depth] : ref_none;
  }
  return next;
}

// ---- leaves

#ifdef NEAREST_ENTITY
// From the asked point to the target, in the entity's frame.
vec3 offset_to(Instance i, vec3 point) {
  const vec3 center = i.box_center * i.scale;
#ifdef NEAREST_CENTER
  return center - point;
#else
  const vec3 half_extent = i.box_half * i.scale;
  return clamp(point - center, -half_extent, half_extent) - (point - center);
#endif
}
#else
TrianglePoint nearest_on_slot(uint slot, vec3 scale, vec3 point, out uint triangle) {
  const int base = int(slot * triangle_texels);
  const vec4 t0 = texelFetch(triangles, base);
  triangle = floatBitsToUint(t0.w);
  precise vec3 a = t0.xyz * scale;
  precise vec3 b = texelFetch(triangles, base + 1).xyz * scale;
  precise vec3 c = texelFetch(triangles, base + 2).xyz * scale;
  return nearest_on_triangle(a - point, b - point, c - point);
}
#endif

NeighborRecord described(Candidate candidate, NearestRecord record, Asked asked) {
  Instance i = fetch_instance(instances, candidate.instance);
  const vec4 q = orientation_at(i.q, i.w, record.t_s);
  const vec3 point = into_frame(i, q, record.t_s, asked.point);
  NeighborRecord neighbor;
  neighbor.entity = candidate.entity;
  neighbor.triangle = candidate.triangle;
  neighbor.instance = candidate.instance;
  neighbor.has_sign = 0u;
  neighbor.distance_m = candidate.distance;
#ifdef NEAREST_ENTITY
  fetch_instance_box(instances, candidate.instance, i);
  const vec3 offset = offset_to(i, point);
  neighbor.u = neighbor.v = 0.0;
#else
  uint triangle;
  const TrianglePoint nearest = nearest_on_slot(candidate.slot, i.scale, point, triangle);
  const vec3 offset = nearest.offset;
  neighbor.u = nearest.u;
  neighbor.v = nearest.v;
#endif
  neighbor.p_world_m = asked.point + rotate(q, offset);
  neighbor.v_relative_mps = velocity_at(i, record.t_s, neighbor.p_world_m) - asked.v;
  return neighbor;
}

void main() {
  // Workgroups are handed to lavapipe's threads in contiguous halves; taking points crosswise gives both the same work.
  const uint group = args.first_group + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x);
  const uint shared_index = group * 64u + gl_LocalInvocationID.x;
  const bool alone = args.alone != 0u;
  const uint index = alone ? args.first_group + gl_WorkGroupID.x : shared_index;
  if (index >= args.count || (alone && gl_LocalInvocationID.x != 0u)) return;
  const NearestRecord record = points[index];
  const Asked asked = asked_of(instances, record);
  set_reach(record.radius_m);

  bool cut_short = false;
  uint current = args.root;
  while (current != ref_none) {
    rounds += 2u;
    while ((current & ref_leaf_bit) == 0u) {
      rounds += 2u;
      current = nearest_child(current, vec3(1.0), asked.point);
      if (depth > stack_limit || rounds > max_rounds) {
        cut_short = true;
        depth = 0u;
        current = ref_none;
      }
      if (current == ref_none) current = next_waiting(0u);
    }
    if (current == ref_none) break;
    const uint place = (current & ref_instance_mask) + record.instance_base;
    Instance i = fetch_instance(instances, place);
    const bool wanted = (i.mask & record.mask) != 0u && i.entity != record.excluded;
    const vec4 q = orientation_at(i.q, i.w, record.t_s);
    const vec3 point = into_frame(i, q, record.t_s, asked.point);
#ifdef NEAREST_ENTITY
    fetch_instance_box(instances, place, i);
    if (wanted) offer(Candidate(length(offset_to(i, point)), i.entity, 0u, place, 0u));
#else
#ifdef NEAREST_SURFACE
    // Only the nearest of the entity's triangles will be offered.
    const float reach_before = reach;
    Candidate own = Candidate(reach, no_entity, 0u, place, 0u);
#endif
    const uint bottom = depth;
    uint node = wanted ? i.blas_root : ref_none;
    while (node != ref_none) {
      rounds += 3u;
      while ((node & ref_leaf_bit) == 0u) {
        rounds += 2u;
        node = nearest_child(node, i.scale, point);
        if (depth > stack_limit || rounds > max_rounds) {
          cut_short = true;
          depth = bottom;
          node = ref_none;
        }
        if (node == ref_none) node = next_waiting(bottom);
      }
      if (node == ref_none) break;
      const uint first = node & ref_triangle_first_mask;
      const uint count = (node >> ref_triangle_count_shift & 0xFu) + 1u;
      for (uint k = 0u; k < count; ++k) {
        ++rounds;
        uint triangle;
        const float square = nearest_on_slot(first + k, i.scale, point, triangle).square;
        const Candidate candidate = Candidate(sqrt(square), i.entity, triangle, place, first + k);
#ifdef NEAREST_SURFACE
        const bool better = precedes(candidate, own);
        own.distance = better ? candidate.distance : own.distance;
        own.entity = better ? candidate.entity : own.entity;
        own.triangle = better ? candidate.triangle : own.triangle;
        own.slot = better ? candidate.slot : own.slot;
        set_reach(own.distance);
#else
        offer(candidate);
#endif
      }
      node = next_waiting(bottom);
      if (rounds > max_rounds) {
        cut_short = true;
        break;
      }
    }
#ifdef NEAREST_SURFACE
    set_reach(reach_before);
    if (own.entity != no_entity) offer(own);
#endif
#endif
    if (cut_short || rounds > max_rounds) {
      cut_short = true;
      break;
    }
    current = next_waiting(0u);
  }

  rounds += found;
  cut_short = cut_short || rounds > max_rounds;
  if (cut_short) found = 0u;
  for (uint place = 0u; place < found; ++place)
    neighbors[index * args.k + place] = described(listed(place), record, asked);
  cut_short = cut_short || !loops_still_turn(args.two);
  counts[index] = NearestCount(cut_short ? 0u : found, cut_short ? 1u : 0u);
}
