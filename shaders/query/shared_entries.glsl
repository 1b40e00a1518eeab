// Where packets that follow one another come into the geometry that they meet first. A beam around the rays of all of them goes down from
// its root ahead of them, and the nodes and runs of triangles that it enters, eight at most, are the entries: each packet holds its
// own beam against those, one a lane, and goes on below them. (One such node, the entry point, is that of Reshetov, Soupikov and Hurley
// 2005; but a beam soon enters more than one child.) Whatever is left out no ray enters, so answers do not depend on it.
//
// Included by packet.glsl.
#ifndef RTSTDB_QUERY_SHARED_ENTRIES_GLSL
#define RTSTDB_QUERY_SHARED_ENTRIES_GLSL

#ifdef RAY_MOVING
// At many instants at once there is no one beam: the root alone.
struct Entries {
  uint reference;
};

Entries entries_into(uint instance, uint root, Entries shared_ones) { return Entries(root); }
uint entries_entered(Entries entries, Beam beam, Range range) { return 1u; }
uint take_entry(Entries entries, inout uint left) {
  const uint reference = left == 0u ? ref_none : entries.reference;
  left = 0u;
  return reference;
}
#else
struct Entries {
  uint instance;  // into whose geometry they lead
  uint used;      // one bit a lane that has one; they stand in the order in which the beam comes by them
  // The lane's own, in the frame of the geometry.
  uint reference;
  vec3 low;
  vec3 high;
};

// The way in by the root, whose box is not looked at.
Entries root_alone(uint instance, uint root) {
  return Entries(instance, 1u, root, vec3(-3.4e38), vec3(3.4e38));
}

Entries entries_into(uint instance, uint root, Entries shared_ones) {
  Entries entries = root_alone(instance, root);
  if (instance == shared_ones.instance) entries = shared_ones;
  return entries;
}

// One bit an entry that the beam enters.
uint entries_entered(Entries entries, Beam beam, Range range) {
  const bool enters_it =
      enters((entries.low + beam.minus_o_low) * beam.inverse_low,
             (entries.high + beam.minus_o_high) * beam.inverse_high, beam.both_ways, range);
  return in_any(enters_it ? 1u << gl_SubgroupInvocationID : 0u) & entries.used;
}

// The exponent of a power of two is the place of its bit.
uint place_of_bit(uint bit) { return uint(floatBitsToInt(float(int(bit))) >> 23) - 127u; }

// The first of those left, or ref_none.
uint take_entry(Entries entries, inout uint left) {
  const uint rest = left & (left - 1u);
  const uint reference = of_lane(entries.reference, place_of_bit(left ^ rest) & 7u);
  const bool none = left == 0u;
  left = rest;
  return none ? ref_none : reference;
}

// Enough for eight entries some levels below the root.
const uint max_entry_rounds = 48u;

// Rays between bounds along each axis.
struct Bounds {
  vec3 min_d;
  vec3 max_d;
  vec3 min_minus_o;
  vec3 max_minus_o;
  float lambda_min;
  float lambda_max;
};

void take_in(inout Bounds bounds, vec3 d, vec3 minus_o, float lambda_min, float lambda_max) {
  bounds.min_d = least(bounds.min_d, d);
  bounds.max_d = most(bounds.max_d, d);
  bounds.min_minus_o = least(bounds.min_minus_o, minus_o);
  bounds.max_minus_o = most(bounds.max_minus_o, minus_o);
  bounds.lambda_min = lesser_of(bounds.lambda_min, lambda_min);
  bounds.lambda_max = greater_of(bounds.lambda_max, lambda_max);
}

Bounds of_all_lanes(Bounds own) {
  return Bounds(min_of_lanes(own.min_d), -min_of_lanes(-own.max_d), min_of_lanes(own.min_minus_o),
                -min_of_lanes(-own.max_minus_o), min_of_lanes(own.lambda_min), max_of_lanes(own.lambda_max));
}

float largest_of(vec3 a, vec3 b) {
  const vec3 size = most(abs(a), abs(b));
  return greater_of(greater_of(size.x, size.y), size.z);
}

// Turned, and grown by more than it takes to round what is turned alone.
void turn(vec4 q, inout vec3 low, inout vec3 high) {
  const vec3 center = rotate(q, 0.5 * (low + high));
  const vec3 half_extent = 0.5 * (high - low);
  const vec3 reach = abs(rotate(q, vec3(half_extent.x, 0.0, 0.0))) +
                     abs(rotate(q, vec3(0.0, half_extent.y, 0.0))) +
                     abs(rotate(q, vec3(0.0, 0.0, half_extent.z))) + 2e-6 * largest_of(low, high);
  low = center - reach;
  high = center + reach;
}

// Directions as they are divided by: nowhere zero (inverse_direction).
Beam beam_between(Bounds bounds, float blur_m) {
  const vec3 tiny = vec3(1e-17 * largest_of(bounds.min_d, bounds.max_d));
  return beam_between(mix(bounds.min_d, -tiny, lessThan(abs(bounds.min_d), tiny)),
                      mix(bounds.max_d, tiny, lessThan(abs(bounds.max_d), tiny)), bounds.min_minus_o - blur_m,
                      bounds.max_minus_o + blur_m);
}

// The same rays in the frame of an instance, as enter_instance brings each there.
Beam beam_into(Instance i, int t_ns, uvec4 root, Bounds world) {
  const vec4 q = conjugate(orientation_of(i, t_ns));
  const vec3 p = position_of(i, t_ns);
  Bounds there = world;
  there.min_minus_o += p;
  there.max_minus_o += p;
  turn(q, there.min_minus_o, there.max_minus_o);
  turn(q, there.min_d, there.max_d);
  there.min_d /= i.scale;
  there.max_d /= i.scale;
  there.min_minus_o /= i.scale;
  there.max_minus_o /= i.scale;
  const vec3 origin = uintBitsToFloat(root.xyz);
  return beam_between(there, blur_of(most(abs(origin + there.min_minus_o), abs(origin + there.max_minus_o)),
                                     quantum_of(root)));
}

// Child k of those entered: the lane that has it.
uint lane_of_child(uint entered, uint k) {
  uint bits = entered;
  [[unroll]] for (uint i = 0u; i < 7u; ++i) bits = i < k ? bits & (bits - 1u) : bits;
  return place_of_bit(bits ^ (bits & (bits - 1u))) & 7u;
}

// The reference of the lane's child.
uint child_reference(uvec4 texels, ChildLane child_lane) {
  const uint slot = gl_SubgroupInvocationID ^ child_lane.octant;
  const uvec4 refs = of_lane(texels, 4u + (slot >> 2));
  const uint low = (slot & 1u) != 0u ? refs.y : refs.x;
  const uint high = (slot & 1u) != 0u ? refs.w : refs.z;
  return (slot & 2u) != 0u ? high : low;
}

// Of rays that lie between the bounds and ask at one instant. `d`: of one of them, by whose order children are come by.
Entries find_entries(Bounds world, vec3 d, int t_ns, uint instance_base, uint root, inout uint rounds) {
  const Range range =
      Range(floatBitsToInt(world.lambda_min), floatBitsToInt(max(world.lambda_max * 1.000001, 1e-37)));
  const ChildLane world_child_lane = child_lane_of(octant_of(d));
  Search search = nothing_begun(rounds + 4u, rounds + max_entry_rounds);
  const uint pending = root == ref_none ? ref_none
                                        : descend_entities(root, search, vec2(0.0), world_child_lane,
                                                           beam_between(world, 0.0), range);
  const uint instance = pending == ref_none ? no_entity : (pending & ref_instance_mask) + instance_base;
  const Instance candidate = instance_at(pending == ref_none ? 0u : instance);
  const Beam beam = beam_into(candidate, t_ns, head_of(candidate.blas_root), world);
  const ChildLane child_lane =
      child_lane_of(octant_of(rotate(conjugate(orientation_of(candidate, t_ns)), d)));
  Entries entries = root_alone(instance, candidate.blas_root);
  const uint lane = gl_SubgroupInvocationID;
  uint count = 1u;
  uint at = 0u;  // those before are kept as they are
  uint tries = 0u;
  do {
    const uint current = of_lane(entries.reference, at & 7u);
    const bool inner = (current & ref_leaf_bit) == 0u;
    const uvec4 texels = imageLoad(nodes, lane_texel(inner ? current : 0u, 0u, node_texels));
    const uint entered = children_entered(texels, child_lane, beam, 0.0, range);
    const uint children = uint(bitCount(entered));
    const bool opens = inner && count - 1u + children <= 8u;
    // In place of the one, its children.
    const bool is_child = lane >= at && lane < at + children;
    const uint from_lane = lane_of_child(entered, lane - at);
    const uint other_lane = lane < at ? lane : (lane + 1u - children) & 7u;
    const Child child = child_of(texels, child_lane);
    const uvec4 head = of_lane(texels, 0u);
    // Rounded once, no corner comes to lie within the vertices that it bounds, which are of the same numbers.
    const vec3 child_low = of_lane(uintBitsToFloat(head.xyz) + quantum_of(head) * child.low, from_lane);
    const vec3 child_high = of_lane(uintBitsToFloat(head.xyz) + quantum_of(head) * child.high, from_lane);
    const uint child_ref = of_lane(child_reference(texels, child_lane), from_lane);
    const vec3 other_low = of_lane(entries.low, other_lane);
    const vec3 other_high = of_lane(entries.high, other_lane);
    const uint other_ref = of_lane(entries.reference, other_lane);
    if (opens) {
      entries.low = is_child ? child_low : other_low;
      entries.high = is_child ? child_high : other_high;
      entries.reference = is_child ? child_ref : other_ref;
      count += children - 1u;
    } else {
      ++at;
    }
    ++tries;
  } while (at < count && tries < max_entry_rounds);
  entries.used = (1u << count) - 1u;
  rounds = search.rounds + tries;
  return entries;
}
#endif

#endif
