// Rays through both levels of the structure (paper, Section 5.2). One loop over nodes, one over leaves ("while-while", Aila
// and Laine 2009); child tests and pushes without branches, because masked lanes run a branch's body anyway on lavapipe.
//
// Include with RAY_ANY defined for rays that stop at the first hit.
#ifndef RTSTDB_QUERY_TRAVERSE_GLSL
#define RTSTDB_QUERY_TRAVERSE_GLSL
#include "common/instance.glsl"
#include "shared/node.h"
#include "shared/query.h"

layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform samplerBuffer instances;

const uint stack_size = 128u;
// Every inner node pushes at most 7 references.
const uint stack_limit = stack_size - 8u;
// Lavapipe stops all loops of an invocation after 65,535 rounds without a word; a search that comes near says so itself.
const uint max_rounds = 60000u;

// A ray in the frame of what is being traversed.
struct Segment {
  vec3 o;
  vec3 d;
  vec3 inverse_d;
};

vec3 inverse_direction(vec3 d) {
  const float tiny = 1e-30;
  const vec3 safe = mix(d, mix(vec3(tiny), vec3(-tiny), lessThan(d, vec3(0.0))), lessThan(abs(d), vec3(tiny)));
  return 1.0 / safe;
}

Segment make_segment(vec3 o, vec3 d) { return Segment(o, d, inverse_direction(d)); }

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

// Edge functions of Woop, Benthin and Wald 2013 in the Plücker form: the products of a shared edge are the same numbers for
// both its triangles (`precise` keeps the compiler from fusing them), so no ray slips between two triangles. Edges belong
// to both.
void test_triangle(Segment ray, uint slot, float lambda_min, uint instance, uint entity, inout Found best) {
  const int base = int(slot * triangle_texels);
  const vec4 t0 = texelFetch(triangles, base);
  const uint triangle = floatBitsToUint(t0.w);
  const vec3 a = t0.xyz - ray.o;
  const vec3 b = texelFetch(triangles, base + 1).xyz - ray.o;
  const vec3 c = texelFetch(triangles, base + 2).xyz - ray.o;
  precise vec3 cb = c.yzx * b.zxy - c.zxy * b.yzx;
  precise vec3 ac = a.yzx * c.zxy - a.zxy * c.yzx;
  precise vec3 ba = b.yzx * a.zxy - b.zxy * a.yzx;
  precise float wa = ray.d.x * cb.x + ray.d.y * cb.y + ray.d.z * cb.z;
  precise float wb = ray.d.x * ac.x + ray.d.y * ac.y + ray.d.z * ac.z;
  precise float wc = ray.d.x * ba.x + ray.d.y * ba.y + ray.d.z * ba.z;
  const bool inside = (wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0);
  const float determinant = wa + wb + wc;
  const vec3 n = cross(b - a, c - a);
  const float along = dot(ray.d, n);
  const float lambda = dot(a, n) / along;
  const bool in_range = inside && determinant != 0.0 && along != 0.0 && lambda >= lambda_min && lambda <= best.lambda;
  const bool nearer = lambda < best.lambda || best.status == status_miss || entity < best.entity ||
                      (entity == best.entity && triangle < best.triangle);
  if (in_range && nearer) {
    best.status = status_hit;
    best.lambda = lambda;
    best.u = wb / determinant;
    best.v = wc / determinant;
    best.instance = instance;
    best.entity = entity;
    best.triangle = triangle;
    best.slot = slot;
    best.front = along < 0.0;
  }
}

Found trace(Segment world, float lambda_min, float lambda_max, float t_s, float motion_t_s, uint mask, uint root) {
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
    // Down through nodes until a leaf, the end of an instance, or the end.
    while ((current & ref_leaf_bit) == 0u) {
      ++rounds;
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
        // A relative 1e-6 covers the rounding of slope, offset and their sum.
        const bool entered = begin <= min(end + abs(end) * 1e-6, best.lambda) && ref != ref_none;
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
        current = stack_lambda[depth] <= best.lambda ? stack_ref[depth] : ref_none;
      }
      if (current == ref_none) break;
    }

    if (current == ref_none) break;
    if (current == ref_leave_instance) {
      ray = world;
    } else if ((current & ref_instance_bit) != 0u) {
      const Instance candidate = fetch_instance(instances, current & ref_instance_mask);
      if ((candidate.mask & mask) != 0u) {
        stack_ref[depth] = ref_leave_instance;
        stack_lambda[depth] = -3.4e38;
        ++depth;
        instance = current & ref_instance_mask;
        entity = candidate.entity;
        ray = enter_instance(world, candidate, motion_t_s);
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
    while (current == ref_none && depth > 0u) {
      ++rounds;
      --depth;
      current = stack_lambda[depth] <= best.lambda ? stack_ref[depth] : ref_none;
    }
    if (rounds > max_rounds) {
      cut_short = true;
      break;
    }
  }
#ifdef RAY_ANY
  if (best.status == status_miss && cut_short) best.status = status_incomplete;
#else
  if (cut_short) best.status = status_incomplete;
#endif
  return best;
}

#endif
