// A ray in the frame of an entity, and its intersection with a triangle there. All ray kernels use these
// functions, so an answer has the same bits from any of them.
#ifndef RTSTDB_QUERY_RAY_RAY_TRIANGLE_GLSL
#define RTSTDB_QUERY_RAY_RAY_TRIANGLE_GLSL
#include "common/instance.glsl"
#include "shared/node.h"
#include "shared/query.h"

// A ray in the frame of the tree that is traversed.
struct Segment {
  // Not o: the compiler would move the negation into the expression for o and evaluate it at every visit.
  vec3 minus_o;
  vec3 d;
  vec3 inverse_d;
  // For triangles: the dominant axis of the direction, and the shear that makes the ray the z axis (see
  // test_corners).
  uint axis;
  vec3 shear;
  uint octant;
  uint order;         // a single ray visits children in ascending slot ^ order
  uint group_bit[8];  // of the child in each slot: 1 << (slot ^ order)
  // Upper bound of the rounding error of corners, boxes and the ray, in the frame of a geometry.
  float blur_m;
};

vec3 quantum_of(uvec4 head) {
  return vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
              uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
}

// Rounding error of the content of a node's boxes relative to the ray's origin, for its transformation and
// the tests: less than this part of the largest distance along an axis.
float blur_of(vec3 origin_from_ray, vec3 quantum) {
  const ivec3 farthest = floatBitsToInt(abs(origin_from_ray) + 255.0 * quantum);
  return 1e-6 * intBitsToFloat(max(max(farthest.x, farthest.y), farthest.z));
}

vec3 inverse_direction(vec3 d) {
  // Beside the largest component, a component this small moves the ray by nothing over the width of a world;
  // and its inverse times the coordinates of any box stays finite, also for large or fast bodies far beyond
  // the limit of positions.
  const float tiny = 1e-17 * max(max(abs(d.x), abs(d.y)), abs(d.z));
  const vec3 safe =
      mix(d, mix(vec3(tiny), vec3(-tiny), lessThan(d, vec3(0.0))), lessThan(abs(d), vec3(tiny)));
  return 1.0 / safe;
}

// Permutes the axes cyclically so that `axis` comes last.
vec3 axis_last(vec3 p, uint axis) {
  const vec3 turned = axis == 0u ? p.yzx : p.zxy;
  return axis == 2u ? p : turned;
}

uint octant_of(vec3 d) { return (d.x < 0.0 ? 1u : 0u) | (d.y < 0.0 ? 2u : 0u) | (d.z < 0.0 ? 4u : 0u); }

// The order of slots that begins with the nearest child or, where any hit is enough, with the farthest: a ray
// often begins at a surface or inside near boxes, which it crosses in part, while it crosses farther ones
// from side to side.
uint order_of(uint octant) {
#ifdef RAY_ANY
  return octant ^ 7u;
#else
  return octant;
#endif
}

Segment make_segment(vec3 minus_o, vec3 d, float blur_m) {
  const vec3 size = abs(d);
  const uint axis = size.x > size.y ? (size.x > size.z ? 0u : 2u) : (size.y > size.z ? 1u : 2u);
  const vec3 along = axis_last(d, axis);
  Segment ray;
  ray.minus_o = minus_o;
  ray.d = d;
  ray.inverse_d = inverse_direction(d);
  ray.axis = axis;
  ray.shear = vec3(along.xy, 1.0) / along.z;
  ray.octant = octant_of(d);
  ray.order = order_of(ray.octant);
  [[unroll]] for (uint slot = 0u; slot < 8u; ++slot) ray.group_bit[slot] = 1u << (slot ^ ray.order);
  ray.blur_m = blur_m;
  return ray;
}

// A ray in the world, where each node has its own rounding bound, so that a far entity does not enlarge the
// boxes of others.
Segment make_segment(vec3 minus_o, vec3 d) { return make_segment(minus_o, d, 0.0); }

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

// A box that begins beyond this lambda holds no hit that is nearer or ties; covers the rounding of boxes. Not
// negative, so that it may be compared as an integer.
float reach_of(Found best) { return max(best.lambda * 1.000001, 1e-37); }

// The ray in the frame of an instance at `t_ns`. The direction is not normalised, so that lambda is the same
// in both frames. `root`: the head of the geometry's first node.
Segment enter_instance(Segment world, Instance i, int t_ns, uvec4 root) {
  const vec4 q = conjugate(orientation_of(i, t_ns));
  precise vec3 minus_o = position_of(i, t_ns) + world.minus_o;
  const vec3 minus_o_there = rotate(q, minus_o) / i.scale;
  return make_segment(minus_o_there, rotate(q, world.d) / i.scale,
                      blur_of(uintBitsToFloat(root.xyz) + minus_o_there, quantum_of(root)));
}

// Whether a hit replaces the best so far: the nearer one, then the lower entity, then the lower triangle.
// Without a best, whether it lies in the range.
bool precedes(float lambda, uint entity, uint triangle, Found best) {
  const bool nearer = lambda < best.lambda || best.status == status_miss || entity < best.entity ||
                      (entity == best.entity && triangle < best.triangle);
  return lambda <= best.lambda && nearer;
}

float lesser_of(float a, float b) { return b < a ? b : a; }
float greater_of(float a, float b) { return b > a ? b : a; }
vec3 least(vec3 a, vec3 b) { return mix(a, b, lessThan(b, a)); }
vec3 most(vec3 a, vec3 b) { return mix(a, b, greaterThan(b, a)); }

// Whether all are above zero, compared as integers: positive floats have the order of their bits, and -0 is
// not positive.
bool all_above(vec3 v) {
  const ivec3 bits = floatBitsToInt(v);
  return min(min(bits.x, bits.y), bits.z) > 0;
}

// Whether a triangle lies to one side of the ray, which is the z axis, along x or y.
bool beside(vec2 a, vec2 b, vec2 c) {
  const vec3 x = vec3(a.x, b.x, c.x);
  const vec3 y = vec3(a.y, b.y, c.y);
  return all_above(x) || all_above(-x) || all_above(y) || all_above(-y);
}

// Twice the signed area of the triangle of the origin, p and q. Swapping p and q changes the sign alone.
float edge_function(vec2 p, vec2 q) {
  precise float area = p.x * q.y - p.y * q.x;
  return area;
}

// Watertight test (Woop, Benthin and Wald 2013). Each corner is sheared by itself so that the ray becomes the
// z axis, so all triangles that share a corner get the same point, and both triangles of an edge get the same
// products (`precise` keeps the compiler from fusing them): no ray passes between them. An edge belongs to
// both. Corners are relative to the ray's origin, with an error that grows with their distance alone, not
// with the size of the triangle.
//
// For a triangle far beside the ray, the edge products are rounding noise of either sign. Such a triangle is
// rejected by its corners: the ray lies between the corners of every triangle that it hits, by the same
// numbers.
//
// The hit is clamped to the triangle's bounds, by the arithmetic with which boxes are entered. So a box that
// is skipped, because it lies beyond the nearest hit or outside the range, holds no hit that another order of
// traversal would accept. For a large triangle the barycentric weights alone may place the hit outside of the
// bounds.
void test_corners(Segment ray, vec4 t0, vec4 t1, vec3 t2, uint slot, float lambda_min, float faces,
                  uint instance, uint entity, inout Found best) {
  const uint triangle = floatBitsToUint(t0.w);
  const vec3 to_a = t0.xyz + ray.minus_o;
  const vec3 to_b = t1.xyz + ray.minus_o;
  const vec3 to_c = t2 + ray.minus_o;
  precise vec3 at_a = to_a * ray.inverse_d;
  precise vec3 at_b = to_b * ray.inverse_d;
  precise vec3 at_c = to_c * ray.inverse_d;
  const vec3 blur = ray.blur_m * abs(ray.inverse_d);
  precise vec3 enters = least(least(at_a, at_b), at_c) - blur;
  precise vec3 leaves = most(most(at_a, at_b), at_c) + blur;
  const float first = greater_of(greater_of(enters.x, enters.y), enters.z);
  const float last = lesser_of(lesser_of(leaves.x, leaves.y), leaves.z);
  const vec3 a = axis_last(to_a, ray.axis);
  const vec3 b = axis_last(to_b, ray.axis);
  const vec3 c = axis_last(to_c, ray.axis);
  precise vec2 a2 = a.xy - ray.shear.xy * a.z;
  precise vec2 b2 = b.xy - ray.shear.xy * b.z;
  precise vec2 c2 = c.xy - ray.shear.xy * c.z;
  const float wa = edge_function(c2, b2);
  const float wb = edge_function(a2, c2);
  const float wc = edge_function(b2, a2);
  const bool inside =
      ((wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0)) && !beside(a2, b2, c2);
  const float sum = wa + wb + wc;
  const float lambda =
      lesser_of(greater_of((wa * a.z + wb * b.z + wc * c.z) / sum * ray.shear.z, first), last);
  const float facing = sum * ray.shear.z;
  const bool in_range = inside && sum != 0.0 && first <= last &&
                        floatBitsToUint(t1.w) != triangle_without_area && facing * faces >= 0.0 &&
                        lambda >= lambda_min;
  if (in_range && precedes(lambda, entity, triangle, best)) {
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

#endif
