// The steps of a search by one lane for one ray. Tests of children and pushes have no branches, since on
// lavapipe masked lanes run the body of a branch anyway.
//
// Macros: RAY_ANY, RAY_MOVING, RAY_LIST (ray.comp); RAY_PAUSES where a search may go on in another dispatch
// (pause.glsl).
#ifndef RTSTDB_QUERY_RAY_STEPS_GLSL
#define RTSTDB_QUERY_RAY_STEPS_GLSL
#include "query/ray/ray_args.glsl"
#include "query/ray/rounds.glsl"
#include "query/simd8/together.glsl"
#include "query/ray/slabs.glsl"

layout(set = 0, binding = 0) uniform usamplerBuffer nodes;  // of geometries
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer tlas;
layout(set = 0, binding = 3) uniform samplerBuffer instances;

// At most one group per level of a tree: a binary tree has at most a level for each bit of a code (63) and of
// a place (32).
const uint stack_size = paused_ray_groups;

Instance instance_at(uint index) { return fetch_instance(instances, index); }

vec4 triangle_texel(int place) { return texelFetch(triangles, place); }

uvec4 head_of(uint node) { return texelFetch(nodes, int(node * node_texels)); }

void test_triangle(Segment ray, uint slot, float lambda_min, float faces, uint instance, uint entity,
                   inout Found best) {
  const int base = int(slot * triangle_texels);
  test_corners(ray, triangle_texel(base), triangle_texel(base + 1), triangle_texel(base + 2).xyz, slot,
               lambda_min, faces, instance, entity, best);
}

#ifdef RAY_LIST
// The nearest hits so far, in order; empty entries have an infinite lambda. The other fields of a hit are
// computed at the end.
float list_lambda[RAY_LIST];
uint list_entity[RAY_LIST];
uint list_triangle[RAY_LIST];
uint list_instance[RAY_LIST];
uint list_slot[RAY_LIST];

void clear_list() {
  [[unroll]] for (uint k = 0u; k < RAY_LIST; ++k) {
    list_lambda[k] = uintBitsToFloat(0x7F800000u);
    list_entity[k] = no_entity;
    list_triangle[k] = list_instance[k] = list_slot[k] = 0u;
  }
}

void exchange(inout uint a, inout uint b, bool wanted) {
  const uint before = a;
  a = wanted ? b : a;
  b = wanted ? before : b;
}

void keep(Found one) {
  float lambda = one.status == status_hit ? one.lambda : uintBitsToFloat(0x7F800000u);
  [[unroll]] for (uint k = 0u; k < RAY_LIST; ++k) {
    const bool precedes =
        lambda < list_lambda[k] ||
        (lambda == list_lambda[k] &&
         (one.entity < list_entity[k] || (one.entity == list_entity[k] && one.triangle < list_triangle[k])));
    const float before = list_lambda[k];
    list_lambda[k] = precedes ? lambda : before;
    lambda = precedes ? before : lambda;
    exchange(list_entity[k], one.entity, precedes);
    exchange(list_triangle[k], one.triangle, precedes);
    exchange(list_instance[k], one.instance, precedes);
    exchange(list_slot[k], one.slot, precedes);
  }
}
#endif

// A group is the children of one node that are still to be visited: the node in the upper 24 bits, below it
// one bit per child in the order of visits: bit i is slot i ^ order. One word, because lavapipe stores lane
// by lane where the address differs between lanes. The extra entry takes the writes of lanes that have no
// work when the stack is full.
uint entity_stack[stack_size + 1u];
uint geometry_stack[stack_size + 1u];

// The edges of all children along one axis: those that the ray meets first, and those that it meets last.
struct Edges {
  uvec2 near;
  uvec2 far;
};

Edges edges_along(uvec4 edges, bool backwards) {
  return Edges(backwards ? edges.zw : edges.xy, backwards ? edges.xy : edges.zw);
}

float quanta_of(uvec2 edges, uint k) { return quanta_of(edges[k >> 2], k & 3u); }

// Converts bits by slot to bits by order of visits.
uint in_group_order(uint slots, uint order) {
  uint bits = slots;
  bits = (order & 1u) != 0u ? (bits & 0x55u) << 1 | (bits >> 1 & 0x55u) : bits;
  bits = (order & 2u) != 0u ? (bits & 0x33u) << 2 | (bits >> 2 & 0x33u) : bits;
  return (order & 4u) != 0u ? (bits & 0x0Fu) << 4 | bits >> 4 : bits;
}

// `entered`: the group's bit for each slot that the ray enters. `used`: the slots that have a child; the box
// of an empty slot is inside out, but rounding may let a distant ray enter it.
uint as_group(uint node, uint entered[8], uint used, uint order) {
  const uint mask = ((entered[0] | entered[1]) | (entered[2] | entered[3])) |
                    ((entered[4] | entered[5]) | (entered[6] | entered[7]));
  return node << 8 | (mask & in_group_order(used, order));
}

// The group of a node's children that the ray enters. `base`: the node's first texel.
uint enter_children(usamplerBuffer of, int base, uint node, Segment ray, bool of_entities, float lambda_min,
                    float limit) {
  const uvec4 head = texelFetch(of, base);
  const Slabs slabs = slabs_of(head, ray, of_entities ? blur_of(head, ray) : ray.blur_m, lambda_min, limit);
  const Edges x = edges_along(texelFetch(of, base + 1), slabs.backwards.x);
  const Edges y = edges_along(texelFetch(of, base + 2), slabs.backwards.y);
  const Edges z = edges_along(texelFetch(of, base + 3), slabs.backwards.z);
  uint entered[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const vec3 near = vec3(quanta_of(x.near, k), quanta_of(y.near, k), quanta_of(z.near, k));
    const vec3 far = vec3(quanta_of(x.far, k), quanta_of(y.far, k), quanta_of(z.far, k));
    entered[k] = enters(slabs, near, far) ? ray.group_bit[k] : 0u;
  }
  return as_group(node, entered, head.w >> 24, ray.order);
}

uint enter_geometry(uint node, Segment ray, float lambda_min, float limit) {
  return enter_children(nodes, int(node * node_texels), node, ray, false, lambda_min, limit);
}

#ifdef RAY_MOVING
float quanta_at(uvec2 begin, uvec2 end, uint k, float share) {
  return quanta_at(begin[k >> 2], end[k >> 2], k & 3u, share);
}

// The same in the TLAS. `share`: the part of the window that has passed at the ray's time.
uint enter_entities(uint node, float share, Segment ray, float lambda_min, float limit) {
  const int base = int(node * tlas_node_texels);
  const uvec4 head = texelFetch(tlas, base);
  const Slabs slabs = slabs_of(head, ray, blur_of(head, ray), lambda_min, limit);
  Edges begin[3];
  Edges end[3];
  [[unroll]] for (int axis = 0; axis < 3; ++axis) {
    begin[axis] = edges_along(texelFetch(tlas, base + 1 + axis), slabs.backwards[axis]);
    end[axis] = edges_along(texelFetch(tlas, base + 6 + axis), slabs.backwards[axis]);
  }
  uint entered[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    vec3 near;
    vec3 far;
    [[unroll]] for (int axis = 0; axis < 3; ++axis) {
      near[axis] = quanta_at(begin[axis].near, end[axis].near, k, share);
      far[axis] = quanta_at(begin[axis].far, end[axis].far, k, share);
    }
    entered[k] = enters(slabs, near, far) ? ray.group_bit[k] : 0u;
  }
  return as_group(node, entered, head.w >> 24, ray.order);
}
#else
// The same in the TLAS, where the window is one instant.
uint enter_entities(uint node, float share, Segment ray, float lambda_min, float limit) {
  return enter_children(tlas, int(node * tlas_node_texels), node, ray, true, lambda_min, limit);
}
#endif

// The state of a search in one tree, without its stack. `rounds`: loop iterations so far, of max_rounds; a
// search with a lower limit begins with a higher count.
struct Search {
  uint depth;
  uint rounds;
};

#ifdef RAY_PAUSES
bool may_pause() { return args.is_retry != 0u; }
#else
bool may_pause() { return false; }
#endif

Search nothing_begun() { return Search(0u, may_pause() ? 0u : max_rounds - rounds_at_first); }

// False: the search has used its rounds of this dispatch and pauses.
bool may_go_on(Search search) {
#ifdef RAY_PAUSES
  return search.rounds < (may_pause() ? rounds_at_once : max_rounds);
#else
  return true;
#endif
}

// The next child to visit, of the group `at_hand` or else of the group on top of the stack; ref_none when
// none is left.
uint take_next(bool of_entities, inout Search search, uint at_hand, uint order) {
  const bool pop = (at_hand & 0xFFu) == 0u;
  const bool done = pop && search.depth == 0u;
  // Read in any case, so that the read does not wait for the decision.
  const uint top = max(search.depth, 1u) - 1u;
  const uint waiting = of_entities ? entity_stack[top] : geometry_stack[top];
  search.depth -= pop && !done ? 1u : 0u;
  const uint group = pop ? waiting : at_hand;
  const uint rest = group & (group - 1u);
  // The exponent of a power of two is the index of its bit.
  const uint slot = (uint(floatBitsToInt(float(int(group ^ rest))) >> 23) - 127u) ^ order;
  if (of_entities) {
    entity_stack[search.depth] = rest;
  } else {
    geometry_stack[search.depth] = rest;
  }
  search.depth += (rest & 0xFFu) != 0u && !done ? 1u : 0u;
  search.rounds = search.depth >= stack_size ? max(search.rounds, max_rounds) : search.rounds;
  const uint texel = (group >> 8) * (of_entities ? tlas_node_texels : node_texels) + 4u + (slot >> 2);
  const uvec4 refs = of_entities ? texelFetch(tlas, int(texel)) : texelFetch(nodes, int(texel));
  const uint low = (slot & 1u) != 0u ? refs.y : refs.x;
  const uint high = (slot & 1u) != 0u ? refs.w : refs.z;
  return done || search.rounds >= max_rounds ? ref_none : (slot & 2u) != 0u ? high : low;
}

// A group without effect: taking its one child changes nothing.
const uint idle_group = 1u;

bool is_inner(uint current) { return (current & ref_leaf_bit) == 0u; }
bool is_leaf(uint current) { return !is_inner(current) && current != ref_none; }

// Goes down a geometry's tree to a leaf: a run of triangles.
uint descend_geometry(uint node, inout Search search, Segment ray, float lambda_min, float limit) {
  uint current = node;
  do {
    ++search.rounds;
    const bool inner = is_inner(current);
    const uint entered = enter_geometry(inner ? current : 0u, ray, lambda_min, limit);
    const uint next = take_next(false, search, inner ? entered : idle_group, ray.order);
    current = inner ? next : current;
  } while (another_round(is_inner(current) && may_go_on(search)));
  return current;
}

// Tests the triangles of a leaf. Any other reference: tests nothing.
void test_run(uint run, inout Search search, Segment ray, float lambda_min, float faces, uint last_kept,
              uint instance, uint entity, inout Found best) {
  const uint first = is_leaf(run) ? run & ref_triangle_first_mask : 0u;
  const uint end = is_leaf(run) ? first + (run >> ref_triangle_count_shift & 0xFu) + 1u : 0u;
  uint slot = first;
  do {
    ++search.rounds;
    const float begin = slot < end ? lambda_min : uintBitsToFloat(0x7F800000u);
#ifdef RAY_LIST
    Found one = nothing_within(best.lambda);
    test_triangle(ray, slot, begin, faces, instance, entity, one);
    keep(one);
    best.lambda = min(best.lambda, list_lambda[last_kept]);
#else
    test_triangle(ray, slot, begin, faces, instance, entity, best);
#endif
    ++slot;
  } while (another_round(slot < end));
}

uint unless_found(uint current, Found best) {
#ifdef RAY_ANY
  return best.status == status_hit ? ref_none : current;
#else
  return current;
#endif
}

// Goes from `below` of a geometry's tree to the next leaf and tests all leaves that follow one another. Ends
// at an inner node, when none is left, or when the search pauses.
uint go_through_leaves(uint below, inout Search search, Segment ray, float lambda_min, float faces,
                       uint last_kept, uint instance, uint entity, inout Found best) {
  uint current = descend_geometry(below, search, ray, lambda_min, reach_of(best));
  do {
    ++search.rounds;
    test_run(current, search, ray, lambda_min, faces, last_kept, instance, entity, best);
    const bool leaf = is_leaf(current);
    const uint next = take_next(false, search, leaf ? 0u : idle_group, ray.order);
    current = leaf ? unless_found(next, best) : current;
  } while (another_round(is_leaf(current) && may_go_on(search)));
  return current;
}

// Instances that a ray has found in the TLAS and not entered yet, in that order, followed by ref_none.
const uint max_pending = 4u;

struct PendingInstances {
  uint leaf[max_pending];
};

PendingInstances no_pending() {
  PendingInstances pending;
  [[unroll]] for (uint k = 0u; k < max_pending; ++k) pending.leaf[k] = ref_none;
  return pending;
}

uint count_of(PendingInstances pending) {
  uint count = 0u;
  [[unroll]] for (uint k = 0u; k < max_pending; ++k) count += pending.leaf[k] != ref_none ? 1u : 0u;
  return count;
}

bool is_full(PendingInstances pending) { return pending.leaf[max_pending - 1u] != ref_none; }

void append(inout PendingInstances pending, bool wanted, uint leaf) {
  bool before = wanted;  // all entries before this one are used
  [[unroll]] for (uint k = 0u; k < max_pending; ++k) {
    const bool free = pending.leaf[k] == ref_none;
    pending.leaf[k] = before && free ? leaf : pending.leaf[k];
    before = before && !free;
  }
}

// The list without its first entry; empty when the ray is complete.
PendingInstances rest_of(PendingInstances pending, Found best) {
  PendingInstances rest = no_pending();
  [[unroll]] for (uint k = 1u; k < max_pending; ++k) rest.leaf[k - 1u] = unless_found(pending.leaf[k], best);
  return rest;
}

// Whether a ray has nodes left in the TLAS, and room for another pending instance.
bool goes_on(uint current, PendingInstances pending) { return current != ref_none && !is_full(pending); }

// Visits a node of the TLAS, or appends an instance.
void visit_next(inout uint current, inout PendingInstances pending, inout Search search, float share,
                Segment world, float lambda_min, float limit) {
  const bool goes = goes_on(current, pending);
  const bool inner = goes && is_inner(current);
  append(pending, goes && !inner, current);
  const uint entered = enter_entities(inner ? current : 0u, share, world, lambda_min, limit);
  const uint group = inner ? entered : goes ? 0u : idle_group;
  const uint next = take_next(true, search, group, world.order);
  current = goes ? next : current;
}

#endif
