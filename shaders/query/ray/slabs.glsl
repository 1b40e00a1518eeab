// A ray in the coordinates of a node, and whether it enters the box of a child.
#ifndef RTSTDB_QUERY_RAY_SLABS_GLSL
#define RTSTDB_QUERY_RAY_SLABS_GLSL
#include "query/ray/ray_triangle.glsl"

// Lambda at a plane is slope * quanta + offset.
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

// For a node of the TLAS.
float blur_of(uvec4 head, Segment world) {
  return blur_of(uintBitsToFloat(head.xyz) + world.minus_o, quantum_of(head));
}

// Whether the ray enters the box between two corners, in quanta. Compared as integers: floats that are not
// negative have the order of their bits, and negative ones are below all of them.
bool enters(Slabs slabs, vec3 near, vec3 far) {
  const ivec3 begin = floatBitsToInt(near * slabs.slope + slabs.offset);
  const ivec3 end = floatBitsToInt(far * slabs.far_slope + slabs.far_offset);
  return max(max(begin.x, begin.y), max(begin.z, slabs.first)) <=
         min(min(end.x, end.y), min(end.z, slabs.last));
}

// Edge k of four in a word.
float quanta_of(uint edges, uint k) { return float(int(edges >> 8u * k & 0xFFu)); }

// An edge at a share of the window, between its positions at the begin and the end.
float quanta_at(uint begin, uint end, uint k, float share) {
  const float from = quanta_of(begin, k);
  return from + share * (quanta_of(end, k) - from);
}

#endif
