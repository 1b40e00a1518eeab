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

const uint stack_size = 128u;
// Every inner node pushes at most 7 references.
const uint stack_limit = stack_size - 8u;

// A ray in the frame of what is being traversed.
struct Segment {
  vec3 o;
  vec3 d;
  vec3 inverse_d;
  // For triangles: the axis along which the ray runs most, and what makes it the z axis (see test_triangle).
  uint axis;
  vec3 shear;
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
  return Segment(o, d, inverse_direction(d), axis, vec3(along.xy, 1.0) / along.z);
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
void test_triangle(Segment ray, uint slot, float lambda_min, uint instance, uint entity, inout Found best) {
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
  const bool in_range = inside && sum != 0.0 && lambda >= lambda_min && lambda <= best.lambda;
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
    best.front = sum * ray.shear.z > 0.0;
  }
}

// `t_s`: since the epoch of the instances that stand from `instance_base` on. `two`: see loops_still_turn.
Found trace(Segment world, float lambda_min, float lambda_max, float t_s, uint instance_base, uint mask, uint root, uint two) {
  Found best;
  best.status = status_miss;
  best.lambda = lambda_max;
  best.u = best.v = 0.0;
  best.instance = best.entity = no_entity;
  best.triangle = best.slot = 0u;
  best.front = false;

  uint stack_ref[stack_size];
  float stack_lambda[stack_size];
  uint depth = 0u;
  uint rounds = 0u;
  bool cut_short = false;
  uint current = root;
  uint instance = no_entity;
  uint entity = no_entity;
  Segment ray = world;

  while (current != ref_none) {
    rounds += 5u;  // this loop's, and one for each of the four inside
    // Down through nodes until a leaf, the end of an instance, or the end.
    while ((current & ref_leaf_bit) == 0u) {
      rounds += 2u;
      const int base = int(current * node_texels);
      const uvec4 head = texelFetch(nodes, base);
      const uvec4 ex = texelFetch(nodes, base + 1);
      const uvec4 ey = texelFetch(nodes, base + 2);
      const uvec4 ez = texelFetch(nodes, base + 3);
      const uvec4 refs_low = texelFetch(nodes, base + 4);
      const uvec4 refs_high = texelFetch(nodes, base + 5);
      const vec3 quantum = vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
                                uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
      const vec3 slope = quantum * ray.inverse_d;
      const vec3 offset = (uintBitsToFloat(head.xyz) - ray.o) * ray.inverse_d;
      const bvec3 backwards = lessThan(ray.inverse_d, vec3(0.0));
      const uvec2 near_x = backwards.x ? ex.zw : ex.xy;
      const uvec2 far_x = backwards.x ? ex.xy : ex.zw;
      const uvec2 near_y = backwards.y ? ey.zw : ey.xy;
      const uvec2 far_y = backwards.y ? ey.xy : ey.zw;
      const uvec2 near_z = backwards.z ? ez.zw : ez.xy;
      const uvec2 far_z = backwards.z ? ez.xy : ez.zw;
      // A relative 1e-6 covers the rounding of slope, offset and their sum, and keeps ties in reach.
      const float limit = best.lambda + abs(best.lambda) * 1e-6;
      uint nearest = ref_none;
      float nearest_lambda = 3.4e38;
      [[unroll]] for (uint k = 0u; k < 8u; ++k) {
        const uint word = k >> 2;
        const uint bit = 8u * (k & 3u);
        const float begin = max(max(float(near_x[word] >> bit & 0xFFu) * slope.x + offset.x,
                                    float(near_y[word] >> bit & 0xFFu) * slope.y + offset.y),
                                max(float(near_z[word] >> bit & 0xFFu) * slope.z + offset.z, lambda_min));
        const float end = min(min(float(far_x[word] >> bit & 0xFFu) * slope.x + offset.x,
                                  float(far_y[word] >> bit & 0xFFu) * slope.y + offset.y),
                              float(far_z[word] >> bit & 0xFFu) * slope.z + offset.z);
        const uint ref = k < 4u ? refs_low[k] : refs_high[k - 4u];
        const bool entered = begin <= min(end + abs(end) * 1e-6, limit) && ref != ref_none;
        // The nearest stays in hand; the one it displaces, or this one, goes to the stack.
        const bool closer = entered && begin < nearest_lambda;
        stack_ref[depth] = closer ? nearest : ref;
        stack_lambda[depth] = closer ? nearest_lambda : begin;
        depth += (closer ? nearest != ref_none : entered) ? 1u : 0u;
        nearest = closer ? ref : nearest;
        nearest_lambda = closer ? begin : nearest_lambda;
      }
      current = nearest;
      if (depth > stack_limit || rounds > max_rounds) {
        cut_short = true;
        depth = 0u;
        current = ref_none;
      }
      // Nothing entered: back to what waits, passing over what a hit has since put out of reach.
      while (current == ref_none && depth > 0u) {
        ++rounds;
        --depth;
        current = stack_lambda[depth] <= limit ? stack_ref[depth] : ref_none;
      }
      if (current == ref_none) break;
    }

    if (current == ref_none) break;
    if (current == ref_leave_instance) {
      ray = world;
    } else if ((current & ref_instance_bit) != 0u) {
      const uint place = (current & ref_instance_mask) + instance_base;
      const Instance candidate = fetch_instance(instances, place);
      if ((candidate.mask & mask) != 0u) {
        stack_ref[depth] = ref_leave_instance;
        stack_lambda[depth] = -3.4e38;
        ++depth;
        instance = place;
        entity = candidate.entity;
        ray = enter_instance(world, candidate, t_s);
        current = candidate.blas_root;
        continue;
      }
    } else {
      const uint first = current & ref_triangle_first_mask;
      const uint count = (current >> ref_triangle_count_shift & 0xFu) + 1u;
      for (uint k = 0u; k < count; ++k) {
        ++rounds;
        test_triangle(ray, first + k, lambda_min, instance, entity, best);
      }
#ifdef RAY_ANY
      if (best.status == status_hit) break;
#endif
    }
    current = ref_none;
    const float limit = best.lambda + abs(best.lambda) * 1e-6;
    while (current == ref_none && depth > 0u) {
      ++rounds;
      --depth;
      current = stack_lambda[depth] <= limit ? stack_ref[depth] : ref_none;
    }
    if (rounds > max_rounds) {
      cut_short = true;
      break;
    }
  }
#ifdef RAY_ANY
  // A hit is one, whatever was not looked at.
  cut_short = cut_short && best.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(two)) best.status = status_incomplete;
  return best;
}

#endif
