// A ray seen from a node, and whether it enters a child's box.
#ifndef RTSTDB_QUERY_RAY_SLABS_GLSL
#define RTSTDB_QUERY_RAY_SLABS_GLSL
#include "query/ray/ray_triangle.glsl"

// Lambda of a plane is slope * quanta + offset.
struct Slabs {
  vec3 slope;
  vec3 offset;
  vec3 far_slope;
  vec3 far_offset;
  bvec3 backwards;
  int first;
  int last;
};

Slabs slabs_of(uvec4 head, Segment ray, float blur_m, float lambda_min, float limit) {
  Slabs slabs;
  slabs.slope = quantum_of(head) * ray.inverse_d;
  const vec3 offset = (uintBitsToFloat(head.xyz) + ray.minus_o) * ray.inverse_d;
  const vec3 blur = blur_m * abs(ray.inverse_d);
  slabs.offset = offset - blur;
  // A relative 1e-6 covers the rounding of slope, offset and their sum.
  slabs.far_slope = slabs.slope * 1.000001;
  slabs.far_offset = offset * 1.000001 + blur;
  slabs.backwards = lessThan(ray.inverse_d, vec3(0.0));
  slabs.first = floatBitsToInt(lambda_min);
  slabs.last = floatBitsToInt(limit);
  return slabs;
}

// Of a node of the entities' tree.
float blur_of(uvec4 head, Segment world) {
  return blur_of(uintBitsToFloat(head.xyz) + world.minus_o, quantum_of(head));
}

// Whether the ray enters the box between two corners, in quanta. Floats that are not negative are ordered as their bits;
// negative ones come below all, which is all that is asked of them.
bool enters(Slabs slabs, vec3 near, vec3 far) {
  const ivec3 begin = floatBitsToInt(near * slabs.slope + slabs.offset);
  const ivec3 end = floatBitsToInt(far * slabs.far_slope + slabs.far_offset);
  return max(max(begin.x, begin.y), max(begin.z, slabs.first)) <=
         min(min(end.x, end.y), min(end.z, slabs.last));
}

// Edge k of four in a word.
float quanta_of(uint edges, uint k) { return float(int(edges >> 8u * k & 0xFFu)); }

// While the window passes from one edge to the other.
float quanta_at(uint begin, uint end, uint k, float share) {
  const float from = quanta_of(begin, k);
  return from + share * (quanta_of(end, k) - from);
}

#endif
