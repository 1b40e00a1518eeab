// Eight rays between bounds, and which children of a node they may enter: each lane holds the beam against a child of its own.
//
// Include with RAY_MOVING defined where the rays ask at different instants.
#ifndef RTSTDB_QUERY_SIMD8_BEAM_GLSL
#define RTSTDB_QUERY_SIMD8_BEAM_GLSL
#include "query/simd8/lanes.glsl"
#include "query/ray/ray_triangle.glsl"

// Which child of a node a lane decodes: lane j has that in slot j ^ octant, so that a packet comes by them in the order of lanes.
struct ChildLane {
  uint octant;
  bool upper;  // of the eight slots: their edges are in the second word
  uint shift;  // of its byte there
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

// The rays of a packet between bounds along each axis (interval arithmetic: Boulos, Wald and Shirley 2006).
//
// Where all go the same way along an axis, whichever it is, none meets the low edge of a box beyond where the one bound leads, and none
// the high edge beyond where the other does. Where some go one way and some the other, they meet the edge that faces them, and no
// edge ends them all.
struct Beam {
  vec3 minus_o_low;
  vec3 minus_o_high;
  vec3 inverse_low;   // of the largest components of directions: for low edges
  vec3 inverse_high;  // of the least
  bvec3 both_ways;
};

// Between the least and the most along each axis, of directions that are nowhere zero and of origins, negated.
Beam beam_between(vec3 min_d, vec3 max_d, vec3 minus_o_low, vec3 minus_o_high) {
  const bvec3 backwards = lessThan(max_d, vec3(0.0));
  const bvec3 not_forwards = lessThan(min_d, vec3(0.0));
  // A relative 1e-6 where lambda ends covers the rounding of slope, offset and their sum.
  return Beam(minus_o_low, minus_o_high, mix(vec3(1.0), vec3(1.000001), backwards) / max_d,
              mix(vec3(1.000001), vec3(1.0), not_forwards) / min_d, notEqual(not_forwards, backwards));
}

// Of the lanes that ask.
Beam beam_of(bool asks, Segment ray) {
  const vec3 none = vec3(3.4e38);
  const vec3 d = 1.0 / ray.inverse_d;
  return beam_between(min_of_lanes(asks ? d : none), -min_of_lanes(asks ? -d : none),
                      min_of_lanes(asks ? ray.minus_o - ray.blur_m : none),
                      -min_of_lanes(asks ? -ray.minus_o - ray.blur_m : none));
}

// Where lambda begins and ends, of rays that still ask.
struct Range {
  int first;
  int last;
};

Range range_of(float lambda_min, float limit) {
  return Range(floatBitsToInt(min_of_lanes(lambda_min)), floatBitsToInt(max_of_lanes(limit)));
}

// A beam seen from a node: lambda of a plane is slope * quanta + offset.
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

// Of a node of the entities' tree.
float blur_of(uvec4 head, Beam world) {
  const vec3 low = uintBitsToFloat(head.xyz) + world.minus_o_low;
  const vec3 high = uintBitsToFloat(head.xyz) + world.minus_o_high;
  return blur_of(max(abs(low), abs(high)), quantum_of(head));
}

// Whether a ray of the beam may enter a box, by lambda of its planes. Floats that are not negative are ordered as their bits; negative
// ones come below all, which is all that is asked of them.
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

// The children that the beam enters, one bit a lane. `blur_m`: beside what is in the beam already.
uint children_entered(uvec4 texels, ChildLane child_lane, Beam beam, float blur_m, Range range) {
  const uvec4 head = of_lane(texels, 0u);
  const Child child = child_of(texels, child_lane);
  const bool enters_it = enters(slabs_of(head, beam, blur_m), beam.both_ways, child.low, child.high, range);
  return in_any(enters_it && (head.w & child_lane.used_bit) != 0u ? 1u << gl_SubgroupInvocationID : 0u);
}

#ifdef RAY_MOVING
// The same for entities, at the shares of the window that have passed when the rays ask. `ends`: edges at the window's end.
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
