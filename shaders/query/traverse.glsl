// Rays through both levels of the structure (paper, Section 5.2). One loop over nodes, one over leaves ("while-while", Aila
// and Laine 2009); child tests and pushes without branches, because masked lanes run a branch's body anyway on lavapipe.
//
// Include with RAY_ANY defined for rays that stop at the first hit.
#ifndef RTSTDB_QUERY_TRAVERSE_GLSL
#define RTSTDB_QUERY_TRAVERSE_GLSL
#include "common/instance.glsl"
#include "common/loops.glsl"
#include "shared/node.h"
#include "shared/query.h"

layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform samplerBuffer instances;

// One group a level of the trees at most.
const uint stack_size = 48u;

// A ray in the frame of what is being traversed.
struct Segment {
  vec3 o;
  vec3 d;
  vec3 inverse_d;
  // For triangles: the axis along which the ray runs most, and what makes it the z axis (see test_triangle).
  uint axis;
  vec3 shear;
  uint octant;
};

vec3 inverse_direction(vec3 d) {
  const float tiny = 1e-30;
  const vec3 safe = mix(d, mix(vec3(tiny), vec3(-tiny), lessThan(d, vec3(0.0))), lessThan(abs(d), vec3(tiny)));
  return 1.0 / safe;
}

// Axes in turn, so that `axis` comes last.
vec3 axis_last(vec3 p, uint axis) {
  const vec3 turned = axis == 0u ? p.yzx : p.zxy;
  return axis == 2u ? p : turned;
}

Segment make_segment(vec3 o, vec3 d) {
  const vec3 size = abs(d);
  const uint axis = size.x > size.y ? (size.x > size.z ? 0u : 2u) : (size.y > size.z ? 1u : 2u);
  const vec3 along = axis_last(d, axis);
  return Segment(o, d, inverse_direction(d), axis, vec3(along.xy, 1.0) / along.z,
                 (d.x < 0.0 ? 1u : 0u) | (d.y < 0.0 ? 2u : 0u) | (d.z < 0.0 ? 4u : 0u));
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

// The frame of an instance at `t_s`, in which its geometry stands still. The direction is not normalised, so that lambda
// means the same on both sides.
Segment enter_instance(Segment world, Instance i, float t_s) {
  const vec4 q = conjugate(orientation_at(i.q, i.w, t_s));
  const vec3 p = i.p + i.v * t_s;
  return make_segment(rotate(q, world.o - p) / i.scale, rotate(q, world.d) / i.scale);
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
  const vec3 a = axis_last(t0.xyz - ray.o, ray.axis);
  const vec3 b = axis_last(texelFetch(triangles, base + 1).xyz - ray.o, ray.axis);
  const vec3 c = axis_last(texelFetch(triangles, base + 2).xyz - ray.o, ray.axis);
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

// A group: children of one node still to be visited; the node in the upper 24 bits, below it one bit a child, in the order in
// which the ray comes by them: bit i is slot i ^ octant. One word, because a store to a place that differs from lane to lane is
// dear on lavapipe.
uint stack[stack_size];

// The children of a node that the ray enters, as a group.
uint enter_children(uint node, Segment ray, float lambda_min, float limit) {
  const int base = int(node * node_texels);
  const uvec4 head = texelFetch(nodes, base);
  const uvec4 ex = texelFetch(nodes, base + 1);
  const uvec4 ey = texelFetch(nodes, base + 2);
  const uvec4 ez = texelFetch(nodes, base + 3);
  const vec3 quantum = vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
                            uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
  const vec3 slope = quantum * ray.inverse_d;
  const vec3 offset = (uintBitsToFloat(head.xyz) - ray.o) * ray.inverse_d;
  // A relative 1e-6 covers the rounding of slope, offset and their sum.
  const vec3 far_slope = slope * 1.000001;
  const vec3 far_offset = offset * 1.000001;
  const bvec3 backwards = lessThan(ray.inverse_d, vec3(0.0));
  const uvec2 near_x = backwards.x ? ex.zw : ex.xy;
  const uvec2 far_x = backwards.x ? ex.xy : ex.zw;
  const uvec2 near_y = backwards.y ? ey.zw : ey.xy;
  const uvec2 far_y = backwards.y ? ey.xy : ey.zw;
  const uvec2 near_z = backwards.z ? ez.zw : ez.xy;
  const uvec2 far_z = backwards.z ? ez.xy : ez.zw;
  // Floats that are not negative are ordered as their bits; negative ones come below all, which is all that is asked of them.
  const int first = floatBitsToInt(lambda_min);
  const int last = floatBitsToInt(limit);
  uint mask = 0u;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint word = k >> 2;
    const uint bit = 8u * (k & 3u);
    const int begin = max(max(floatBitsToInt(float(int(near_x[word] >> bit & 0xFFu)) * slope.x + offset.x),
                              floatBitsToInt(float(int(near_y[word] >> bit & 0xFFu)) * slope.y + offset.y)),
                          max(floatBitsToInt(float(int(near_z[word] >> bit & 0xFFu)) * slope.z + offset.z), first));
    const int end = min(min(floatBitsToInt(float(int(far_x[word] >> bit & 0xFFu)) * far_slope.x + far_offset.x),
                            floatBitsToInt(float(int(far_y[word] >> bit & 0xFFu)) * far_slope.y + far_offset.y)),
                        min(floatBitsToInt(float(int(far_z[word] >> bit & 0xFFu)) * far_slope.z + far_offset.z), last));
    mask |= begin <= end ? 1u << k : 0u;
  }
  // An empty slot's box is inside out, which a distant ray may not notice.
  mask &= head.w >> 24;
  mask = (ray.octant & 1u) != 0u ? (mask & 0x55u) << 1 | (mask >> 1 & 0x55u) : mask;
  mask = (ray.octant & 2u) != 0u ? (mask & 0x33u) << 2 | (mask >> 2 & 0x33u) : mask;
  mask = (ray.octant & 4u) != 0u ? (mask & 0x0Fu) << 4 | mask >> 4 : mask;
  return node << 8 | mask;
}

// What is left of a search: the group at hand, those on the stack, and how long it took.
struct Search {
  uint group;
  uint depth;
  uint rounds;
};

// The next child, or ref_none when nothing is left above `bottom`.
uint take_next(inout Search search, uint bottom, uint octant) {
  const bool pop = (search.group & 0xFFu) == 0u;
  const bool done = pop && search.depth == bottom;
  search.depth -= pop && !done ? 1u : 0u;
  const uint group = pop ? stack[search.depth] : search.group;
  const uint rest = group & (group - 1u);
  // The exponent of a power of two is the place of its bit.
  const uint slot = (uint(floatBitsToInt(float(int(group ^ rest))) >> 23) - 127u) ^ octant;
  stack[search.depth] = rest;
  search.depth += (rest & 0xFFu) != 0u && !done ? 1u : 0u;
  search.rounds += search.depth == stack_size ? max_rounds : 0u;
  search.group = 0u;
  const uvec4 refs = texelFetch(nodes, int((group >> 8) * node_texels + 4u + (slot >> 2)));
  const uint low = (slot & 1u) != 0u ? refs.y : refs.x;
  const uint high = (slot & 1u) != 0u ? refs.w : refs.z;
  return done || search.rounds >= max_rounds ? ref_none : (slot & 2u) != 0u ? high : low;
}

// `t_s`: since the epoch of the instances that stand from `instance_base` on. `two`: see loops_still_turn.
//
// Loops end where their condition stands: what follows a break runs for the lanes that are left even when there are none.
Found trace(Segment world, float lambda_min, float lambda_max, float t_s, uint instance_base, uint mask, uint root, float faces,
            uint two) {
  Found best;
  best.status = status_miss;
  best.lambda = lambda_max;
  best.u = best.v = 0.0;
  best.instance = best.entity = no_entity;
  best.triangle = best.slot = 0u;
  best.front = false;

  Search search = Search(0u, 0u, 0u);
  uint current = root;
  while (current != ref_none) {
    // Down the entities' tree to an instance.
    ++search.rounds;
    while ((current & ref_leaf_bit) == 0u) {
      ++search.rounds;
      search.group = enter_children(current, world, lambda_min, best.lambda);
      current = take_next(search, 0u, world.octant);
    }
    if (current == ref_none) break;
    const uint instance = (current & ref_instance_mask) + instance_base;
    const Instance candidate = fetch_instance(instances, instance);
    const Segment ray = enter_instance(world, candidate, t_s);
    const uint bottom = search.depth;
    current = (candidate.mask & mask) != 0u ? candidate.blas_root : ref_none;
    while (current != ref_none) {
      // Down the geometry's tree to a leaf.
      ++search.rounds;
      do {
        ++search.rounds;
        search.group = enter_children(current, ray, lambda_min, best.lambda);
        current = take_next(search, bottom, ray.octant);
      } while ((current & ref_leaf_bit) == 0u);
      if (current == ref_none) break;
      // Leaves, as long as they follow one another.
      do {
        const uint first = current & ref_triangle_first_mask;
        const uint end = first + (current >> ref_triangle_count_shift & 0xFu) + 1u;
        uint slot = first;
        do {
          ++search.rounds;
          test_triangle(ray, slot, lambda_min, faces, instance, candidate.entity, best);
          ++slot;
        } while (slot < end);
        ++search.rounds;
        current = take_next(search, bottom, ray.octant);
#ifdef RAY_ANY
        current = best.status == status_hit ? ref_none : current;
#endif
      } while ((current & ref_leaf_bit) != 0u && current != ref_none);
    }
    search.depth = bottom;
    search.group = 0u;
    current = take_next(search, 0u, world.octant);
#ifdef RAY_ANY
    current = best.status == status_hit ? ref_none : current;
#endif
  }
  bool cut_short = search.rounds >= max_rounds;
#ifdef RAY_ANY
  // A hit is one, whatever was not looked at.
  cut_short = cut_short && best.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(two)) best.status = status_incomplete;
  return best;
}

#endif
