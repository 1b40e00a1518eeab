// A ray seen from a node, and whether it enters a child's box.
#ifndef RTSTDB_QUERY_RAY_SLABS_GLSL
#define RTSTDB_QUERY_RAY_SLABS_GLSL
#include "query/ray_triangle.glsl"

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

// Edge k of four in a word.
float quanta_of(uint edges, uint k) { return float(int(edges >> 8u * k & 0xFFu)); }

// While the window passes from one edge to the other.
float quanta_at(uint begin, uint end, uint k, float share) {
  const float from = quanta_of(begin, k);
  return from + share * (quanta_of(end, k) - from);
}

#endif
