#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Finds the triangles of a surface that are near the box of the other body, and sets their bits. Each
// invocation searches one of the subtrees below the children of the root.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer geometries;
#include "query/contact/surface.glsl"
layout(set = 0, binding = 3, scalar) readonly buffer SidesBuffer { SurfaceSide sides[]; };
layout(set = 0, binding = 4, scalar) buffer BitsBuffer { uint bits[]; };
layout(set = 0, binding = 5, scalar) writeonly buffer StatesBuffer { uint states[]; };

// The box of the body in both frames, wider by the limit.
struct BodyBox {
  vec3 center;  // frame of the side
  vec3 half_extent;
  mat3 axes;        // of the surface's entity, in the frame of the side
  vec3 to_center;   // from the surface's origin, along these axes
  vec3 half_along;  // along these axes
};

BodyBox body_box_of(SurfaceSide side) {
  const int base = int(side.body * geometry_texels);
  BodyBox box;
  box.center = uintBitsToFloat(texelFetch(geometries, base).xyz) * side.body_scale;
  box.half_extent = uintBitsToFloat(texelFetch(geometries, base + 1).xyz) * side.body_scale + side.limit_m +
                    4.0 * side.rounding_m;
  box.axes = axes_of(side.q);
  box.to_center = (box.center - side.origin_m) * box.axes;
  const mat3 s = mat3(abs(box.axes[0]), abs(box.axes[1]), abs(box.axes[2]));
  box.half_along = box.half_extent * s;
  return box;
}

// `lo`, `hi`: of a box of the surface's geometry.
bool is_near(SurfaceSide side, BodyBox box, vec3 lo, vec3 hi) {
  const vec3 center = 0.5 * (lo + hi) * side.surface_scale;
  const vec3 half_extent = 0.5 * (hi - lo) * side.surface_scale;
  const mat3 s = mat3(abs(box.axes[0]), abs(box.axes[1]), abs(box.axes[2]));
  const vec3 in_body = box.axes * center + side.origin_m;
  return all(lessThanEqual(abs(center - box.to_center), half_extent + box.half_along)) &&
         all(lessThanEqual(abs(in_body - box.center), s * half_extent + box.half_extent));
}

// Pushes the children that are near.
void push_near(SurfaceSide side, BodyBox box, uint node) {
  const WideNode wide = fetch_wide_node(nodes, node);
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint ref = child_reference(wide, k);
    stack_ref[depth] = ref;
    depth += ref != ref_none && is_near(side, box, child_lo(wide, k), child_hi(wide, k)) ? 1u : 0u;
  }
}

// Sets the bits of the triangles of a leaf whose boxes overlap the box of the body.
void mark_near_triangles(SurfaceSide side, BodyBox box, uint leaf, uint first_slot) {
  const uint first = leaf & ref_triangle_first_mask;
  const uint count = (leaf >> ref_triangle_count_shift & 0xFu) + 1u;
  uint k = 0u;
  do {
    ++rounds;
    if (k < count) {
      const Triangle t = surface_triangle(side, first + k);
      const vec3 lo = min(t.a, min(t.b, t.c));
      const vec3 hi = max(t.a, max(t.b, t.c));
      const uint place = first + k - first_slot;
      if (all(lessThanEqual(lo, box.center + box.half_extent)) &&
          all(greaterThanEqual(hi, box.center - box.half_extent)))
        atomicOr(bits[side.first_word + place / 32u], 1u << place % 32u);
      ++k;
    }
  } while (k < count);
}

// The reference of a subtree, or ref_none.
uint subtree_of(uint root, uint number) {
  if (!is_inner(root)) return number == 0u ? root : ref_none;
  const uint child = child_reference(fetch_wide_node(nodes, root), number / 8u);
  if (child == ref_none || !is_inner(child)) return number % 8u == 0u ? child : ref_none;
  return child_reference(fetch_wide_node(nodes, child), number % 8u);
}

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) return;
  const SurfaceSide side = sides[index / surface_subtrees];
  const BodyBox box = body_box_of(side);
  const uint first_slot = first_slot_of(side.surface);
  uint current = subtree_of(root_of(side.surface), index % surface_subtrees);
  if (current != ref_none) do {
      rounds += 2u;  // this loop's, and that of the leaf
      if (current != ref_none && is_inner(current)) {
        push_near(side, box, current);
      } else if (current != ref_none) {
        mark_near_triangles(side, box, current, first_slot);
      }
      cut_short = cut_short || depth > stack_limit || rounds > max_rounds;
      const bool goes_on = depth > 0u && !cut_short;
      depth -= goes_on ? 1u : 0u;
      current = goes_on ? stack_ref[depth] : ref_none;
    } while (current != ref_none);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  states[index] = cut_short ? surface_unfinished : surface_ended;
}
