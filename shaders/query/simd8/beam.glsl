// A beam: bounds around the eight rays of a packet, and which children of a node these rays may enter. Each
// lane tests one child.
//
// Macros: RAY_MOVING where rays have different times.
#ifndef RTSTDB_QUERY_SIMD8_BEAM_GLSL
#define RTSTDB_QUERY_SIMD8_BEAM_GLSL
#include "query/simd8/lanes.glsl"
#include "query/ray/ray_triangle.glsl"

// Which child of a node a lane decodes: lane j takes slot j ^ octant, so that a packet visits children in the
// order of lanes.
struct ChildLane {
  uint octant;
  bool upper;  // one of slots 4 to 7, whose edges are in the second word
  uint shift;  // of the child's byte in that word
  uint used_bit;
};

ChildLane child_lane_of(uint octant) {
  const uint slot = gl_SubgroupInvocationID ^ octant;
  return ChildLane(octant, slot >= 4u, 8u * (slot & 3u), 1u << (24u + slot));
}

// The edges of the lane's child along the axes, in quanta.
struct Child {
  vec3 low;
  vec3 high;
};

// `texels`: lanes 1 to 3 have the edges along x, y and z.
Child child_of(uvec4 texels, ChildLane child_lane) {
  Child child;
  [[unroll]] for (uint axis = 0u; axis < 3u; ++axis) {
    const uvec4 edges = of_lane(texels, 1u + axis);
    child.low[axis] = float(int((child_lane.upper ? edges.y : edges.x) >> child_lane.shift & 0xFFu));
    child.high[axis] = float(int((child_lane.upper ? edges.w : edges.z) >> child_lane.shift & 0xFFu));
  }
  return child;
}

// Bounds of the rays of a packet along each axis (interval arithmetic: Boulos, Wald and Shirley 2006).
//
// Where all rays have one direction along an axis, one bound gives the earliest lambda at the low edges of
// boxes, the other one at the high edges. Where they have both directions, each ray meets the edge that faces
// it first, and no edge ends all of them.
struct Beam {
  vec3 minus_o_low;
  vec3 minus_o_high;
  vec3 inverse_low;   // of the largest direction components: for low edges
  vec3 inverse_high;  // of the smallest ones: for high edges
  bvec3 both_ways;
};

// From bounds along each axis of directions, which are nowhere zero, and of negated origins.
Beam beam_between(vec3 min_d, vec3 max_d, vec3 minus_o_low, vec3 minus_o_high) {
  const bvec3 backwards = lessThan(max_d, vec3(0.0));
  const bvec3 not_forwards = lessThan(min_d, vec3(0.0));
  // A relative 1e-6 at the far edges covers the rounding of slope, offset and their sum.
  return Beam(minus_o_low, minus_o_high, mix(vec3(1.0), vec3(1.000001), backwards) / max_d,
              mix(vec3(1.000001), vec3(1.0), not_forwards) / min_d, notEqual(not_forwards, backwards));
}

// Around the rays of the lanes for which `has_ray` holds.
Beam beam_of(bool has_ray, Segment ray) {
  const vec3 none = vec3(3.4e38);
  const vec3 d = 1.0 / ray.inverse_d;
  return beam_between(min_of_lanes(has_ray ? d : none), -min_of_lanes(has_ray ? -d : none),
                      min_of_lanes(has_ray ? ray.minus_o - ray.blur_m : none),
                      -min_of_lanes(has_ray ? -ray.minus_o - ray.blur_m : none));
}

// The range of lambda that some ray still searches.
struct Range {
  int first;
  int last;
};

Range range_of(float lambda_min, float limit) {
  return Range(floatBitsToInt(min_of_lanes(lambda_min)), floatBitsToInt(max_of_lanes(limit)));
}

// A beam in the coordinates of a node: lambda at a plane is slope * quanta + offset.
struct Slabs {
  vec3 slope_low;
  vec3 slope_high;
  vec3 offset_low;
  vec3 offset_high;
};

Slabs slabs_of(uvec4 head, Beam beam, float blur_m) {
  const vec3 quantum = quantum_of(head);
  const vec3 origin = uintBitsToFloat(head.xyz);
  return Slabs(quantum * beam.inverse_low, quantum * beam.inverse_high,
               (origin + beam.minus_o_low - blur_m) * beam.inverse_low,
               (origin + beam.minus_o_high + blur_m) * beam.inverse_high);
}

// For a node of the TLAS.
float blur_of(uvec4 head, Beam world) {
  const vec3 low = uintBitsToFloat(head.xyz) + world.minus_o_low;
  const vec3 high = uintBitsToFloat(head.xyz) + world.minus_o_high;
  return blur_of(max(abs(low), abs(high)), quantum_of(head));
}

// Whether a ray of the beam may enter a box, from lambda at its planes. Compared as integers: floats that are
// not negative have the order of their bits, and negative ones are below all of them.
bool enters(vec3 lambda_low, vec3 lambda_high, bvec3 both_ways, Range range) {
  const ivec3 at_low = floatBitsToInt(lambda_low);
  const ivec3 at_high = floatBitsToInt(lambda_high);
  const ivec3 earlier = min(at_low, at_high);
  const ivec3 later = max(at_low, at_high);
  const ivec3 begin = mix(earlier, later, both_ways);
  const ivec3 end = mix(later, ivec3(0x7F7FFFFF), both_ways);
  return max(max(begin.x, begin.y), max(begin.z, range.first)) <=
         min(min(end.x, end.y), min(end.z, range.last));
}

bool enters(Slabs slabs, bvec3 both_ways, vec3 low, vec3 high, Range range) {
  return enters(low * slabs.slope_low + slabs.offset_low, high * slabs.slope_high + slabs.offset_high,
                both_ways, range);
}

// The children that the beam enters, one bit per lane. `blur_m`: rounding bound in addition to the beam's.
uint children_entered(uvec4 texels, ChildLane child_lane, Beam beam, float blur_m, Range range) {
  const uvec4 head = of_lane(texels, 0u);
  const Child child = child_of(texels, child_lane);
  const bool enters_it = enters(slabs_of(head, beam, blur_m), beam.both_ways, child.low, child.high, range);
  return in_any(enters_it && (head.w & child_lane.used_bit) != 0u ? 1u << gl_SubgroupInvocationID : 0u);
}

#ifdef RAY_MOVING
// The same in the TLAS. `shares`: the range of the rays' times as parts of the window. `ends`: edges at the
// window's end.
uint entities_entered(uvec4 texels, uvec4 ends, ChildLane child_lane, vec2 shares, Beam beam, Range range) {
  const uvec4 head = of_lane(texels, 0u);
  const Child child = child_of(texels, child_lane);
  const Child end = child_of(ends, child_lane);
  const vec3 low_change = end.low - child.low;
  const vec3 high_change = end.high - child.high;
  const vec3 low = min(child.low + shares.x * low_change, child.low + shares.y * low_change);
  const vec3 high = max(child.high + shares.x * high_change, child.high + shares.y * high_change);
  const bool enters_it = enters(slabs_of(head, beam, blur_of(head, beam)), beam.both_ways, low, high, range);
  return in_any(enters_it && (head.w & child_lane.used_bit) != 0u ? 1u << gl_SubgroupInvocationID : 0u);
}
#endif

#endif
