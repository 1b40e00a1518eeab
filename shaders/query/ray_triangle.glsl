// A ray in the frame of an entity, and where it meets a triangle there. Every kernel for rays makes both by these, so that an answer
// has the same bits whichever of them has been asked.
#ifndef RTSTDB_QUERY_RAY_TRIANGLE_GLSL
#define RTSTDB_QUERY_RAY_TRIANGLE_GLSL
#include "common/instance.glsl"
#include "shared/node.h"
#include "shared/query.h"

// A ray in the frame of what is being traversed.
struct Segment {
  vec3 minus_o;  // not o: the compiler would push a negation into what o was made by, and make it anew at every visit
  vec3 d;
  vec3 inverse_d;
  // For triangles: the axis along which the ray runs most, and what makes it the z axis (see test_corners).
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
  float slack;  // what rounding may have taken from lambda
};

Found nothing_within(float lambda_max) {
  return Found(status_miss, lambda_max, 0.0, 0.0, no_entity, no_entity, 0u, 0u, false, 0.0);
}

// A box that begins beyond holds nothing that is nearer or ties: rounding of the box, too, is covered. Not negative, so that it may be
// compared as a whole number.
float reach_of(Found best) { return max(best.lambda * 1.000001 + best.slack, 1e-37); }

// The frame of an instance at `t_ns`, in which its geometry stands still. The direction is not normalised, so that lambda
// means the same on both sides.
Segment enter_instance(Segment world, Instance i, int t_ns) {
  const vec4 q = conjugate(orientation_of(i, t_ns));
  precise vec3 minus_o = position_of(i, t_ns) + world.minus_o;
  return make_segment(rotate(q, minus_o) / i.scale, rotate(q, world.d) / i.scale);
}

// Whether all are above zero. Whole numbers have the order of floats that are, and -0 is none.
bool all_above(vec3 v) {
  const ivec3 bits = floatBitsToInt(v);
  return min(min(bits.x, bits.y), bits.z) > 0;
}

// Whether a triangle lies beside the ray, which is the z axis: to one side of it along x or y.
bool beside(vec2 a, vec2 b, vec2 c) {
  const vec3 x = vec3(a.x, b.x, c.x);
  const vec3 y = vec3(a.y, b.y, c.y);
  return all_above(x) || all_above(-x) || all_above(y) || all_above(-y);
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
//
// Of a triangle far beside the ray nothing is left of the edges' products but rounding, whatever its sign; so it is told by its
// corners. A triangle that the ray meets has it between them, by the same numbers.
void test_corners(Segment ray, vec4 t0, vec4 t1, vec3 t2, uint slot, float lambda_min, float faces, uint instance, uint entity,
                  inout Found best) {
  const uint triangle = floatBitsToUint(t0.w);
  const vec3 a = axis_last(t0.xyz + ray.minus_o, ray.axis);
  const vec3 b = axis_last(t1.xyz + ray.minus_o, ray.axis);
  const vec3 c = axis_last(t2 + ray.minus_o, ray.axis);
  precise vec2 a2 = a.xy - ray.shear.xy * a.z;
  precise vec2 b2 = b.xy - ray.shear.xy * b.z;
  precise vec2 c2 = c.xy - ray.shear.xy * c.z;
  const float wa = edge_function(c2, b2);
  const float wb = edge_function(a2, c2);
  const float wc = edge_function(b2, a2);
  const bool inside = ((wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0)) && !beside(a2, b2, c2);
  const float sum = wa + wb + wc;
  const float lambda = (wa * a.z + wb * b.z + wc * c.z) / sum * ray.shear.z;
  const float facing = sum * ray.shear.z;
  const bool in_range = inside && sum != 0.0 && floatBitsToUint(t1.w) != triangle_without_area && facing * faces >= 0.0 && lambda >= lambda_min && lambda <= best.lambda;
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
    // Lambda is made of the corners' distances, and of the differences by which they were brought about the ray.
    best.slack = 1e-6 * max(max(abs(a.z), abs(b.z)), abs(c.z)) * abs(ray.shear.z);
  }
}

#endif
