// Rays through both levels of the structure (paper, Section 5.2). One loop over nodes, one over leaves ("while-while", Aila
// and Laine 2009); child tests and pushes without branches, because masked lanes run a branch's body anyway on lavapipe.
//
// Include with RAY_ANY defined for rays that stop at the first hit, RAY_MOVING where they ask at different instants,
// RAY_LIST as the largest number of hits that is kept of each, where that is more than one.
#ifndef RTSTDB_QUERY_TRAVERSE_GLSL
#define RTSTDB_QUERY_TRAVERSE_GLSL
#include "common/instance.glsl"
#include "common/loops.glsl"
#include "shared/node.h"
#include "shared/query.h"

layout(set = 0, binding = 0) uniform usamplerBuffer nodes;  // of geometries
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer tlas;
layout(set = 0, binding = 3) uniform samplerBuffer instances;

// One group a level of the trees at most.
const uint stack_size = 48u;

// A ray in the frame of what is being traversed.
struct Segment {
  vec3 minus_o;  // not o: the compiler would push a negation into what o was made by, and make it anew at every visit
  vec3 d;
  vec3 inverse_d;
  // For triangles: the axis along which the ray runs most, and what makes it the z axis (see test_triangle).
  uint axis;
  vec3 shear;
  uint octant;
  uint group_bit[8];  // of the child in a slot: 1 << (slot ^ octant)
};

vec3 inverse_direction(vec3 d) {
  // Beside the largest component so little is nothing, even over the width of a world; and its inverse times the coordinates of any
  // box, which may lie far beyond the limit of positions when it is large or has moved for long, stays finite.
  const float tiny = 1e-17 * max(max(abs(d.x), abs(d.y)), abs(d.z));
  const vec3 safe = mix(d, mix(vec3(tiny), vec3(-tiny), lessThan(d, vec3(0.0))), lessThan(abs(d), vec3(tiny)));
  return 1.0 / safe;
}

// Axes in turn, so that `axis` comes last.
vec3 axis_last(vec3 p, uint axis) {
  const vec3 turned = axis == 0u ? p.yzx : p.zxy;
  return axis == 2u ? p : turned;
}

Segment make_segment(vec3 minus_o, vec3 d) {
  const vec3 size = abs(d);
  const uint axis = size.x > size.y ? (size.x > size.z ? 0u : 2u) : (size.y > size.z ? 1u : 2u);
  const vec3 along = axis_last(d, axis);
  Segment ray;
  ray.minus_o = minus_o;
  ray.d = d;
  ray.inverse_d = inverse_direction(d);
  ray.axis = axis;
  ray.shear = vec3(along.xy, 1.0) / along.z;
  ray.octant = (d.x < 0.0 ? 1u : 0u) | (d.y < 0.0 ? 2u : 0u) | (d.z < 0.0 ? 4u : 0u);
  [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) ray.group_bit[slot] = 1u << (slot ^ ray.octant);
  return ray;
}

struct Found {
  uint status;
  float lambda;
  float u;
  float v;
  uint instance;
  uint entity;
  uint triangle;
  uint slot;  // of the triangle in the leaf order
  bool front;
};

Found nothing_within(float lambda_max) {
  return Found(status_miss, lambda_max, 0.0, 0.0, no_entity, no_entity, 0u, 0u, false);
}

// The frame of an instance at `t_ns`, in which its geometry stands still. The direction is not normalised, so that lambda
// means the same on both sides.
Segment enter_instance(Segment world, Instance i, int t_ns) {
  const vec4 q = conjugate(orientation_of(i, t_ns));
  const vec3 p = position_of(i, t_ns);
  return make_segment(rotate(q, p + world.minus_o) / i.scale, rotate(q, world.d) / i.scale);
}

// Twice the area that the origin, p and q span; swapping p and q turns the sign and changes nothing else.
float edge_function(vec2 p, vec2 q) {
  precise float area = p.x * q.y - p.y * q.x;
  return area;
}

// Watertight (Woop, Benthin and Wald 2013): the corners are sheared so that the ray becomes the z axis, each by itself, hence
// to the same point in every triangle that shares it; then the products of a shared edge are the same numbers for both its
// triangles (`precise` keeps the compiler from fusing them), and no ray slips between. Edges belong to both. Corners are seen
// from the ray's origin with an error that grows with their distance alone, however small the triangle.
void test_triangle(Segment ray, uint slot, float lambda_min, float faces, uint instance, uint entity, inout Found best) {
  const int base = int(slot * triangle_texels);
  const vec4 t0 = texelFetch(triangles, base);
  const uint triangle = floatBitsToUint(t0.w);
  const vec3 a = axis_last(t0.xyz + ray.minus_o, ray.axis);
  const vec3 b = axis_last(texelFetch(triangles, base + 1).xyz + ray.minus_o, ray.axis);
  const vec3 c = axis_last(texelFetch(triangles, base + 2).xyz + ray.minus_o, ray.axis);
  precise vec2 a2 = a.xy - ray.shear.xy * a.z;
  precise vec2 b2 = b.xy - ray.shear.xy * b.z;
  precise vec2 c2 = c.xy - ray.shear.xy * c.z;
  const float wa = edge_function(c2, b2);
  const float wb = edge_function(a2, c2);
  const float wc = edge_function(b2, a2);
  const bool inside = (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0);
  const float sum = wa + wb + wc;
  const float lambda = (wa * a.z + wb * b.z + wc * c.z) / sum * ray.shear.z;
  const float facing = sum * ray.shear.z;
  const bool in_range = inside && sum != 0.0 && facing * faces >= 0.0 && lambda >= lambda_min && lambda <= best.lambda;
  const bool nearer = lambda < best.lambda || best.status == status_miss || entity < best.entity ||
                      (entity == best.entity && triangle < best.triangle);
  if (in_range && nearer) {
    best.status = status_hit;
    best.lambda = lambda;
    best.u = wb / sum;
    best.v = wc / sum;
    best.instance = instance;
    best.entity = entity;
    best.triangle = triangle;
    best.slot = slot;
    best.front = facing > 0.0;
  }
}

#ifdef RAY_LIST
// The nearest hits so far, in order; where there is none, one beyond all. What a hit needs besides is found again at the end.
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
    const bool precedes = lambda < list_lambda[k] ||
                          (lambda == list_lambda[k] && (one.entity < list_entity[k] ||
                                                        (one.entity == list_entity[k] && one.triangle < list_triangle[k])));
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

// A group: children of one node still to be visited; the node in the upper 24 bits, below it one bit a child, in the order in
// which the ray comes by them: bit i is slot i ^ octant. One word, because a store to a place that differs from lane to lane is
// dear on lavapipe.
uint stack[stack_size];

// A ray seen from a node: lambda of a plane is slope * quanta + offset.
struct Slabs {
  vec3 slope;
  vec3 offset;
  vec3 far_slope;
  vec3 far_offset;
  bvec3 backwards;
  int first;
  int last;
};

Slabs slabs_of(uvec4 head, Segment ray, float lambda_min, float limit) {
  const vec3 quantum = vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
                            uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
  Slabs slabs;
  slabs.slope = quantum * ray.inverse_d;
  slabs.offset = (uintBitsToFloat(head.xyz) + ray.minus_o) * ray.inverse_d;
  // A relative 1e-6 covers the rounding of slope, offset and their sum.
  slabs.far_slope = slabs.slope * 1.000001;
  slabs.far_offset = slabs.offset * 1.000001;
  slabs.backwards = lessThan(ray.inverse_d, vec3(0.0));
  slabs.first = floatBitsToInt(lambda_min);
  slabs.last = floatBitsToInt(limit);
  return slabs;
}

// Whether the ray enters the box between two corners, in quanta. Floats that are not negative are ordered as their bits;
// negative ones come below all, which is all that is asked of them.
bool enters(Slabs slabs, vec3 near, vec3 far) {
  const ivec3 begin = floatBitsToInt(near * slabs.slope + slabs.offset);
  const ivec3 end = floatBitsToInt(far * slabs.far_slope + slabs.far_offset);
  return max(max(begin.x, begin.y), max(begin.z, slabs.first)) <= min(min(end.x, end.y), min(end.z, slabs.last));
}

// The edges of one axis, low ones of all children and then high ones, as those that the ray meets first and last.
struct Edges {
  uvec2 near;
  uvec2 far;
};

Edges edges_along(uvec4 edges, bool backwards) {
  return Edges(backwards ? edges.zw : edges.xy, backwards ? edges.xy : edges.zw);
}

float quanta_of(uvec2 edges, uint k) { return float(int(edges[k >> 2] >> 8u * (k & 3u) & 0xFFu)); }

// Bits of slots as bits of a group.
uint in_group_order(uint slots, uint octant) {
  uint bits = slots;
  bits = (octant & 1u) != 0u ? (bits & 0x55u) << 1 | (bits >> 1 & 0x55u) : bits;
  bits = (octant & 2u) != 0u ? (bits & 0x33u) << 2 | (bits >> 2 & 0x33u) : bits;
  return (octant & 4u) != 0u ? (bits & 0x0Fu) << 4 | bits >> 4 : bits;
}

// `entered`: one bit of a group for each slot. `used`: the slots that have a child; the box of an empty one is inside out, which
// a distant ray may not notice.
uint as_group(uint node, uint entered[8], uint used, uint octant) {
  const uint mask = ((entered[0] | entered[1]) | (entered[2] | entered[3])) |
                    ((entered[4] | entered[5]) | (entered[6] | entered[7]));
  return node << 8 | (mask & in_group_order(used, octant));
}

// The children of a node that the ray enters, as a group. `base`: the node's first texel.
uint enter_children(usamplerBuffer of, int base, uint node, Segment ray, float lambda_min, float limit) {
  const uvec4 head = texelFetch(of, base);
  const Slabs slabs = slabs_of(head, ray, lambda_min, limit);
  const Edges x = edges_along(texelFetch(of, base + 1), slabs.backwards.x);
  const Edges y = edges_along(texelFetch(of, base + 2), slabs.backwards.y);
  const Edges z = edges_along(texelFetch(of, base + 3), slabs.backwards.z);
  uint entered[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const vec3 near = vec3(quanta_of(x.near, k), quanta_of(y.near, k), quanta_of(z.near, k));
    const vec3 far = vec3(quanta_of(x.far, k), quanta_of(y.far, k), quanta_of(z.far, k));
    entered[k] = enters(slabs, near, far) ? ray.group_bit[k] : 0u;
  }
  return as_group(node, entered, head.w >> 24, ray.octant);
}

uint enter_geometry(uint node, Segment ray, float lambda_min, float limit) {
  return enter_children(nodes, int(node * node_texels), node, ray, lambda_min, limit);
}

#ifdef RAY_MOVING
float quanta_at(uvec2 begin, uvec2 end, uint k, float share) {
  const float from = quanta_of(begin, k);
  return from + share * (quanta_of(end, k) - from);
}

// The same for entities; `share`: of the window that has passed when the ray asks.
uint enter_entities(uint node, float share, Segment ray, float lambda_min, float limit) {
  const int base = int(node * tlas_node_texels);
  const uvec4 head = texelFetch(tlas, base);
  const Slabs slabs = slabs_of(head, ray, lambda_min, limit);
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
  return as_group(node, entered, head.w >> 24, ray.octant);
}
#else
// The same for entities, all of them where they are at the window's begin, which is its end.
uint enter_entities(uint node, float share, Segment ray, float lambda_min, float limit) {
  return enter_children(tlas, int(node * tlas_node_texels), node, ray, lambda_min, limit);
}
#endif

// What is left of a search: the group at hand, those on the stack, and how long it took.
struct Search {
  uint group;
  uint depth;
  uint rounds;
};

// The next child, or ref_none when nothing is left above `bottom`.
uint take_next(usamplerBuffer of, uint texels, inout Search search, uint bottom, uint octant) {
  const bool pop = (search.group & 0xFFu) == 0u;
  const bool done = pop && search.depth == bottom;
  // Read wherever it stands, whether it is asked for or not: the read need not wait for the answer.
  const uint waiting = stack[max(search.depth, 1u) - 1u];
  search.depth -= pop && !done ? 1u : 0u;
  const uint group = pop ? waiting : search.group;
  const uint rest = group & (group - 1u);
  // The exponent of a power of two is the place of its bit.
  const uint slot = (uint(floatBitsToInt(float(int(group ^ rest))) >> 23) - 127u) ^ octant;
  stack[search.depth] = rest;
  search.depth += (rest & 0xFFu) != 0u && !done ? 1u : 0u;
  search.rounds += search.depth == stack_size ? max_rounds : 0u;
  search.group = 0u;
  const uvec4 refs = texelFetch(of, int((group >> 8) * texels + 4u + (slot >> 2)));
  const uint low = (slot & 1u) != 0u ? refs.y : refs.x;
  const uint high = (slot & 1u) != 0u ? refs.w : refs.z;
  return done || search.rounds >= max_rounds ? ref_none : (slot & 2u) != 0u ? high : low;
}

// Down the entities' tree to the next instance, or none.
uint descend_entities(uint node, inout Search search, float share, Segment world, float lambda_min, float limit) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      search.group = enter_entities(current, share, world, lambda_min, limit);
      current = take_next(tlas, tlas_node_texels, search, 0u, world.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

// The same down a geometry's tree, above `bottom` of the stack, to a run of triangles.
uint descend_geometry(uint node, inout Search search, uint bottom, Segment ray, float lambda_min, float limit) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      search.group = enter_geometry(current, ray, lambda_min, limit);
      current = take_next(nodes, node_texels, search, bottom, ray.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

void test_run(uint run, inout Search search, Segment ray, float lambda_min, float faces, uint last_kept, uint instance, uint entity,
              inout Found best) {
  const uint first = run & ref_triangle_first_mask;
  const uint end = first + (run >> ref_triangle_count_shift & 0xFu) + 1u;
  uint slot = first;
  do {
    ++search.rounds;
    if (slot < end) {
#ifdef RAY_LIST
      Found one = nothing_within(best.lambda);
      test_triangle(ray, slot, lambda_min, faces, instance, entity, one);
      keep(one);
      best.lambda = min(best.lambda, list_lambda[last_kept]);
#else
      test_triangle(ray, slot, lambda_min, faces, instance, entity, best);
#endif
      ++slot;
    }
  } while (slot < end);
}

uint unless_found(uint current, Found best) {
#ifdef RAY_ANY
  return best.status == status_hit ? ref_none : current;
#else
  return current;
#endif
}

// `t_ns`: since the epoch of the instances that stand from `instance_base` on. `share`: of the window that has passed then.
// `two`: see loops_still_turn.
//
// On lavapipe whatever stands in a loop runs in each of its rounds, for nobody if need be, and a round more is made where the
// condition stands before the body. So conditions stand at the end, and no loop is begun again for what only some lanes may
// need: instances that follow one another are met in a loop of their own. Why such loops ask again inside: common/loops.glsl.
Found trace(Segment world, float lambda_min, float lambda_max, int t_ns, float share, uint instance_base, uint mask, uint root,
            float faces, uint last_kept, uint two) {
  Found best = nothing_within(lambda_max);
  Search search = Search(0u, 0u, 0u);
  uint current = root;
  if (current != ref_none) do {
    ++search.rounds;
    current = descend_entities(current, search, share, world, lambda_min, best.lambda);
    if (current == ref_none) break;
    // Instances, as long as they follow one another.
    do {
      search.rounds += 4u;  // this loop's, and those that loops inside make for nobody
      if ((current & ref_leaf_bit) != 0u) {
        const uint instance = (current & ref_instance_mask) + instance_base;
        const Instance candidate = fetch_instance(instances, instance);
        const Segment ray = enter_instance(world, candidate, t_ns);
        const uint bottom = search.depth;
        current = (candidate.mask & mask) != 0u ? candidate.blas_root : ref_none;
        if (current != ref_none) do {
          ++search.rounds;
          current = descend_geometry(current, search, bottom, ray, lambda_min, best.lambda);
          if (current == ref_none) break;
          // Leaves likewise.
          do {
            ++search.rounds;
            if ((current & ref_leaf_bit) != 0u) {
              test_run(current, search, ray, lambda_min, faces, last_kept, instance, candidate.entity, best);
              current = unless_found(take_next(nodes, node_texels, search, bottom, ray.octant), best);
            }
          } while ((current & ref_leaf_bit) != 0u && current != ref_none);
        } while (current != ref_none);
        search.depth = bottom;
        search.group = 0u;
        current = unless_found(take_next(tlas, tlas_node_texels, search, 0u, world.octant), best);
      }
    } while ((current & ref_leaf_bit) != 0u && current != ref_none);
  } while (current != ref_none);
  bool cut_short = search.rounds >= max_rounds;
#ifdef RAY_ANY
  // A hit is one, whatever was not looked at.
  cut_short = cut_short && best.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(two)) best.status = status_incomplete;
  return best;
}

#endif
