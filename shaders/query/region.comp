#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Region and overlap queries at entity level: down the TLAS by axis-aligned boxes, then the exact test of oriented boxes at
// the query's own time. Ids are kept in a heap with the largest on top, so that on overflow the lowest remain.
#include "common/instance.glsl"
#include "common/loops.glsl"
#include "common/wide_node.glsl"
#include "shared/query.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RegionArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer tlas;
layout(set = 0, binding = 1) uniform samplerBuffer instances;
layout(set = 0, binding = 2, scalar) readonly buffer RegionsBuffer { RegionRecord regions[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer CountsBuffer { RegionCount counts[]; };
layout(set = 0, binding = 4, scalar) buffer IdsBuffer { uint ids[]; };

const uint stack_size = 128u;
const uint stack_limit = stack_size - 8u;

struct OrientedBox {
  vec3 center;
  vec4 q;
  vec3 half_extent;
};

void keep_lowest(uint base, uint found, uint id) {
  if (found < args.capacity) {
    uint place = found;
    while (place > 0u && ids[base + (place - 1u) / 2u] < id) {
      ids[base + place] = ids[base + (place - 1u) / 2u];
      place = (place - 1u) / 2u;
    }
    ids[base + place] = id;
    return;
  }
  if (args.capacity == 0u || id >= ids[base]) return;
  uint place = 0u;
  while (true) {
    uint child = 2u * place + 1u;
    if (child >= args.capacity) break;
    if (child + 1u < args.capacity && ids[base + child + 1u] > ids[base + child]) ++child;
    if (ids[base + child] <= id) break;
    ids[base + place] = ids[base + child];
    place = child;
  }
  ids[base + place] = id;
}

// Separating axes of two oriented boxes (Gottschalk, Lin and Manocha 1996). Touching counts.
bool boxes_touch(OrientedBox a, OrientedBox b) {
  const vec4 to_a = conjugate(a.q);
  const vec4 q = quat_product(to_a, b.q);
  const vec3 t = rotate(to_a, b.center - a.center);
  const mat3 r = mat3(rotate(q, vec3(1.0, 0.0, 0.0)), rotate(q, vec3(0.0, 1.0, 0.0)), rotate(q, vec3(0.0, 0.0, 1.0)));
  const mat3 s = mat3(abs(r[0]), abs(r[1]), abs(r[2]));
  bool apart = any(greaterThan(abs(t), a.half_extent + s * b.half_extent));
  [[unroll]] for (int j = 0; j < 3; ++j) {
    apart = apart || abs(dot(t, r[j])) > dot(a.half_extent, s[j]) + b.half_extent[j];
  }
  [[unroll]] for (int i = 0; i < 3; ++i) {
    const int i1 = (i + 1) % 3;
    const int i2 = (i + 2) % 3;
    [[unroll]] for (int j = 0; j < 3; ++j) {
      const int j1 = (j + 1) % 3;
      const int j2 = (j + 2) % 3;
      const float reach_a = a.half_extent[i1] * s[j][i2] + a.half_extent[i2] * s[j][i1];
      const float reach_b = b.half_extent[j1] * s[j2][i] + b.half_extent[j2] * s[j1][i];
      // Axes of parallel edges are null vectors and separate nothing; the slack keeps rounding from claiming that.
      apart = apart || abs(t[i2] * r[j][i1] - t[i1] * r[j][i2]) > reach_a + reach_b + 1e-6 * (length(t) + 1e-3);
    }
  }
  return !apart;
}

bool sphere_touches(vec3 center, float radius, OrientedBox b) {
  const vec3 p = rotate(conjugate(b.q), center - b.center);
  const vec3 outside = max(abs(p) - b.half_extent, vec3(0.0));
  return dot(outside, outside) <= radius * radius;
}

bool corners_inside(OrientedBox region, bool is_sphere, OrientedBox b) {
  bool inside = true;
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const vec3 corner = b.half_extent * vec3((k & 1u) != 0u ? 1.0 : -1.0, (k & 2u) != 0u ? 1.0 : -1.0, (k & 4u) != 0u ? 1.0 : -1.0);
    const vec3 p = rotate(conjugate(region.q), b.center + rotate(b.q, corner) - region.center);
    inside = inside && (is_sphere ? dot(p, p) <= region.half_extent.x * region.half_extent.x
                                  : all(lessThanEqual(abs(p), region.half_extent)));
  }
  return inside;
}

void main() {
  const bool alone = args.alone != 0u;
  const uint index = alone ? gl_WorkGroupID.x : gl_GlobalInvocationID.x;
  if (index >= args.count || (alone && gl_LocalInvocationID.x != 0u)) return;
  const RegionRecord record = regions[index];
  const bool is_sphere = (record.flags & region_is_sphere) != 0u;
  OrientedBox region = OrientedBox(record.center_m, record.q, record.half_extent_m);
  if (record.carrier != no_entity) {
    const Instance i = fetch_instance(instances, record.carrier + record.instance_base);
    const vec4 q = orientation_at(i.q, i.w, record.t_s);
    region.center = i.p + i.v * record.t_s + rotate(q, record.center_m);
    region.q = normalize(quat_product(q, record.q));
  }
  Box reach = is_sphere ? Box(region.center - region.half_extent.x, region.center + region.half_extent.x)
                        : box_of_oriented(region.center, region.q, vec3(0.0), region.half_extent);
  const vec3 slop = 1e-6 * max(abs(reach.lo), abs(reach.hi));
  reach.lo -= slop;
  reach.hi += slop;

  uint stack[stack_size];
  uint depth = 0u;
  uint rounds = 0u;
  uint found = 0u;
  bool cut_short = false;
  uint current = args.root;
  while (current != ref_none) {
    while ((current & ref_leaf_bit) == 0u) {
      ++rounds;
      const MotionNode node = fetch_motion_node(tlas, current, record.share);
      [[unroll]] for (uint k = 0u; k < 8u; ++k) {
        const vec3 lo = child_lo(node, k);
        const vec3 hi = child_hi(node, k);
        const uint ref = child_reference(node, k);
        const bool meets = all(lessThanEqual(lo, reach.hi)) && all(greaterThanEqual(hi, reach.lo)) && ref != ref_none;
        stack[depth] = ref;
        depth += meets ? 1u : 0u;
      }
      if (depth > stack_limit) {
        cut_short = true;
        depth = 0u;
      }
      current = ref_none;
      if (depth == 0u) break;
      current = stack[--depth];
    }
    if (current == ref_none) break;
    const uint place = (current & ref_instance_mask) + record.instance_base;
    Instance i = fetch_instance(instances, place);
    fetch_instance_box(instances, place, i);
    const vec4 q = orientation_at(i.q, i.w, record.t_s);
    const OrientedBox bounds = OrientedBox(i.p + i.v * record.t_s + rotate(q, i.box_center * i.scale), q, i.box_half * i.scale);
    const bool wanted = (i.mask & record.mask) != 0u && i.entity != record.excluded;
    const bool holds = (record.flags & region_wants_inside) != 0u ? corners_inside(region, is_sphere, bounds)
                       : is_sphere                                ? sphere_touches(region.center, region.half_extent.x, bounds)
                                                                  : boxes_touch(region, bounds);
    if (wanted && holds) {
      keep_lowest(index * args.capacity, found, i.entity);
      ++found;
    }
    // This loop, the one over nodes, and the two of the heap.
    rounds += 4u + findMSB(args.capacity + 1u);
    current = ref_none;
    if (rounds > max_rounds) {
      cut_short = true;
      break;
    }
    if (depth > 0u) current = stack[--depth];
  }
  cut_short = cut_short || !loops_still_turn(args.two);
  counts[index] = RegionCount(found, cut_short ? 1u : 0u);
}
