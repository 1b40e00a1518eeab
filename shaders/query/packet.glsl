// Rays that run side by side, eight at a time (packets: Wald, Slusallek, Benthin and Wagner 2001): a lane has a ray, and all lanes go
// down the trees together, into every child that one of them enters. What they read and where they go is the same for all, so a
// node is fetched once, its children are decoded by a lane each and handed round, and the stack lies across the lanes of a few
// words. Tests of boxes and triangles are each ray's own, and answers have the bits of traverse.glsl's.
//
// For subgroups of eight lanes, all of them in use. Where rays part, each pays for all: rtstdb/query/ray_coherence.hpp tells which
// batches come here. On lavapipe an image is loaded without a call, and a shuffle is one or two instructions.
//
// Include with RAY_ANY or RAY_MOVING defined as for traverse.glsl.
#ifndef RTSTDB_QUERY_PACKET_GLSL
#define RTSTDB_QUERY_PACKET_GLSL
#include "common/loops.glsl"
#include "query/ray_triangle.glsl"

layout(set = 0, binding = 0, rgba32ui) readonly uniform uimageBuffer nodes;  // of geometries
layout(set = 0, binding = 1, rgba32ui) readonly uniform uimageBuffer triangles;
layout(set = 0, binding = 2, rgba32ui) readonly uniform uimageBuffer tlas;
layout(set = 0, binding = 3, rgba32ui) readonly uniform uimageBuffer instances;

// One group a level of the trees at most, one lane a group.
const uint stack_words = 3u;
const uint stack_size = 8u * stack_words;

Instance instance_at(uint index) {
  const int base = int(index * instance_texels);
  return instance_from(uintBitsToFloat(imageLoad(instances, base)), uintBitsToFloat(imageLoad(instances, base + 1)),
                       uintBitsToFloat(imageLoad(instances, base + 2)), uintBitsToFloat(imageLoad(instances, base + 3)),
                       uintBitsToFloat(imageLoad(instances, base + 4)));
}

vec4 triangle_texel(int place) { return uintBitsToFloat(imageLoad(triangles, place)); }

uint of_lane(uint v, uint lane) { return subgroupShuffle(v, lane); }
float of_lane(float v, uint lane) { return subgroupShuffle(v, lane); }
vec3 of_lane(vec3 v, uint lane) { return vec3(subgroupShuffle(v.x, lane), subgroupShuffle(v.y, lane), subgroupShuffle(v.z, lane)); }
uvec4 of_lane(uvec4 v, uint lane) {
  return uvec4(subgroupShuffle(v.x, lane), subgroupShuffle(v.y, lane), subgroupShuffle(v.z, lane), subgroupShuffle(v.w, lane));
}

// The bits of all lanes.
uint in_any(uint bits) {
  bits |= subgroupShuffle(bits, gl_SubgroupInvocationID ^ 4u);
  bits |= subgroupShuffle(bits, gl_SubgroupInvocationID ^ 2u);
  return bits | subgroupShuffle(bits, gl_SubgroupInvocationID ^ 1u);
}

uint in_any(uint bits[8]) {
  return in_any(((bits[0] | bits[1]) | (bits[2] | bits[3])) | ((bits[4] | bits[5]) | (bits[6] | bits[7])));
}

// Which child of a node a lane decodes: lane j has that in slot j ^ octant, so that a packet comes by them in the order of lanes.
struct Seat {
  uint octant;
  bool upper;  // of the eight slots: their edges are in the second word
  uint shift;  // of its byte there
  uint used_bit;
};

Seat take_seat(uint octant) {
  const uint slot = gl_SubgroupInvocationID ^ octant;
  return Seat(octant, slot >= 4u, 8u * (slot & 3u), 1u << (24u + slot));
}

// Twice the middles of the lane's child along the axes, in quanta, and twice half its widths.
struct Child {
  vec3 middle;
  vec3 width;
};

// `texels`: lanes 1 to 3 have the edges along x, y and z.
Child child_of(uvec4 texels, Seat seat) {
  Child child;
  [[unroll]] for (uint axis = 0u; axis < 3u; ++axis) {
    const uvec4 edges = of_lane(texels, 1u + axis);
    const int low = int((seat.upper ? edges.y : edges.x) >> seat.shift & 0xFFu);
    const int high = int((seat.upper ? edges.w : edges.z) >> seat.shift & 0xFFu);
    child.middle[axis] = float(low + high);
    child.width[axis] = float(high - low);
  }
  return child;
}

// The width of a child that is none: less than nothing, so that no ray enters it, however far away it is.
float width_of_none() { return uintBitsToFloat(0xFF800000u); }

// A ray seen from a node, as in traverse.glsl; by halves of quanta.
struct Slabs {
  vec3 slope;
  vec3 offset;
  vec3 reach;
  int first;
  int last;
};

Slabs slabs_of(uvec4 head, Segment ray, float lambda_min, float limit) {
  const vec3 quantum = vec3(uintBitsToFloat((head.w & 0xFFu) << 23), uintBitsToFloat((head.w >> 8 & 0xFFu) << 23),
                            uintBitsToFloat((head.w >> 16 & 0xFFu) << 23));
  Slabs slabs;
  slabs.slope = quantum * (0.5 * ray.inverse_d);
  slabs.offset = (uintBitsToFloat(head.xyz) + ray.minus_o) * ray.inverse_d;
  slabs.reach = abs(slabs.slope) * 1.000001;
  slabs.first = floatBitsToInt(lambda_min);
  slabs.last = floatBitsToInt(limit * 1.000001);
  return slabs;
}

// Whether the lane's ray enters a box. By its middle and its width, so that no sign of the direction is asked for, in which the
// rays of a packet may differ. A relative 1e-6 covers rounding, of the nearest so far too; floats are compared as whole numbers, as in traverse.glsl.
bool enters(Slabs slabs, vec3 middle, vec3 width) {
  const vec3 at = middle * slabs.slope + slabs.offset;
  const vec3 reach = width * slabs.reach;
  const ivec3 begin = floatBitsToInt(at - reach);
  const ivec3 end = floatBitsToInt(at + reach);
  const int far = floatBitsToInt(intBitsToFloat(min(min(end.x, end.y), end.z)) * 1.000001);
  return max(max(begin.x, begin.y), max(begin.z, slabs.first)) <= min(far, slabs.last);
}

// The children that some ray enters, one bit a lane. At step k a lane looks at the child k seats on: nothing has to be copied
// to all lanes.
uint children_entered(uvec4 texels, Seat seat, Segment ray, float lambda_min, float limit) {
  const uvec4 head = of_lane(texels, 0u);
  const Slabs slabs = slabs_of(head, ray, lambda_min, limit);
  Child child = child_of(texels, seat);
  child.width.x = (head.w & seat.used_bit) != 0u ? child.width.x : width_of_none();
  uint entered[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint other = gl_SubgroupInvocationID + k & 7u;
    entered[k] = enters(slabs, of_lane(child.middle, other), of_lane(child.width, other)) ? 1u << other : 0u;
  }
  return in_any(entered);
}

#ifdef RAY_MOVING
// The same for entities, at the share of the window that has passed when a ray asks. `ends`: edges at the window's end.
uint entities_entered(uvec4 texels, uvec4 ends, Seat seat, float share, Segment ray, float lambda_min, float limit) {
  const uvec4 head = of_lane(texels, 0u);
  const Slabs slabs = slabs_of(head, ray, lambda_min, limit);
  Child child = child_of(texels, seat);
  const Child end = child_of(ends, seat);
  const vec3 middle_change = end.middle - child.middle;
  const vec3 width_change = end.width - child.width;
  child.width.x = (head.w & seat.used_bit) != 0u ? child.width.x : width_of_none();
  uint entered[8];
  [[unroll]] for (uint k = 0u; k < 8u; ++k) {
    const uint other = gl_SubgroupInvocationID + k & 7u;
    const vec3 middle = of_lane(child.middle, other) + share * of_lane(middle_change, other);
    const vec3 width = of_lane(child.width, other) + share * of_lane(width_change, other);
    entered[k] = enters(slabs, middle, width) ? 1u << other : 0u;
  }
  return in_any(entered);
}
#endif

// What is left of a search: groups of children, each of one node; the node in the upper 24 bits, below it one bit a seat. Group k
// of the stack is in lane k & 7 of word k >> 3.
struct Search {
  uint depth;
  uint rounds;
  uint stack[stack_words];
};

// The group on top of the stack; where none is left above `bottom`, one of a node that there is.
uint top_of(Search search, uint bottom) {
  const uint top = search.depth - 1u;
  const uint low = subgroupShuffle(search.stack[0], top & 7u);
  const uint middle = subgroupShuffle(search.stack[1], top & 7u);
  const uint high = subgroupShuffle(search.stack[2], top & 7u);
  return search.depth == bottom ? 0u : top < 8u ? low : top < 16u ? middle : high;
}

// A lane's texel: of the node, which has its references in the texels 4 and 5, and in lanes 6 and 7 the references of `waiting`,
// the node on top of the stack. Fetched together, before it is known which of both goes on.
int lane_texel(uint node, uint waiting, uint texels) {
  const uint lane = gl_SubgroupInvocationID;
  return int(lane < 6u ? node * texels + lane : waiting * texels + lane - 2u);
}

// The next child, or ref_none when nothing is left above `bottom`: of those just entered, or of the group on top of the stack.
uint take_next(inout Search search, uvec4 texels, uint node, uint entered, uint waiting, uint bottom, uint octant) {
  const bool pop = entered == 0u;
  const bool done = pop && search.depth == bottom;
  const bool spent = search.rounds >= max_rounds;
  search.depth -= pop && !done ? 1u : 0u;
  const uint group = pop ? waiting : node << 8 | entered;
  const uint rest = group & (group - 1u);
  // The exponent of a power of two is the place of its bit.
  const uint slot = (uint(floatBitsToInt(float(int(group ^ rest))) >> 23) - 127u) ^ octant;
  [[unroll]] for (uint word = 0u; word < stack_words; ++word) {
    search.stack[word] = gl_SubgroupInvocationID + 8u * word == search.depth ? rest : search.stack[word];
  }
  search.depth += (rest & 0xFFu) != 0u && !done ? 1u : 0u;
  search.rounds += search.depth == stack_size ? max_rounds : 0u;
  const uvec4 refs = of_lane(texels, (pop ? 6u : 4u) + (slot >> 2));
  const uint low = (slot & 1u) != 0u ? refs.y : refs.x;
  const uint high = (slot & 1u) != 0u ? refs.w : refs.z;
  return done || spent ? ref_none : (slot & 2u) != 0u ? high : low;
}

uint pop_geometry(inout Search search, uint bottom, uint octant) {
  const uint waiting = top_of(search, bottom);
  const uvec4 texels = imageLoad(nodes, lane_texel(0u, waiting >> 8, node_texels));
  return take_next(search, texels, 0u, 0u, waiting, bottom, octant);
}

uint pop_entities(inout Search search, uint octant) {
  const uint waiting = top_of(search, 0u);
  const uvec4 texels = imageLoad(tlas, lane_texel(0u, waiting >> 8, tlas_node_texels));
  return take_next(search, texels, 0u, 0u, waiting, 0u, octant);
}

// Down the entities' tree to the next instance, or none.
uint descend_entities(uint node, inout Search search, float share, Seat seat, Segment world, float lambda_min, float limit) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      const uint waiting = top_of(search, 0u);
      const uvec4 texels = imageLoad(tlas, lane_texel(current, waiting >> 8, tlas_node_texels));
#ifdef RAY_MOVING
      const uvec4 ends = imageLoad(tlas, int(current * tlas_node_texels + 5u + clamp(gl_SubgroupInvocationID, 1u, 3u)));
      const uint entered = entities_entered(texels, ends, seat, share, world, lambda_min, limit);
#else
      const uint entered = children_entered(texels, seat, world, lambda_min, limit);
#endif
      current = take_next(search, texels, current, entered, waiting, 0u, seat.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

// The same down a geometry's tree, above `bottom` of the stack, to a run of triangles.
uint descend_geometry(uint node, inout Search search, uint bottom, Seat seat, Segment ray, float lambda_min, float limit) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      const uint waiting = top_of(search, bottom);
      const uvec4 texels = imageLoad(nodes, lane_texel(current, waiting >> 8, node_texels));
      const uint entered = children_entered(texels, seat, ray, lambda_min, limit);
      current = take_next(search, texels, current, entered, waiting, bottom, seat.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

void test_run(uint run, inout Search search, Segment ray, float lambda_min, float faces, uint instance, uint entity, inout Found best) {
  const uint first = run & ref_triangle_first_mask;
  const uint end = first + (run >> ref_triangle_count_shift & 0xFu) + 1u;
  uint slot = first;
  do {
    ++search.rounds;
    if (slot < end) {
      const vec4 texel = triangle_texel(int(slot * triangle_texels + min(gl_SubgroupInvocationID, 2u)));
      const float number = of_lane(texel.w, 0u);
      test_corners(ray, vec4(of_lane(texel.xyz, 0u), number), of_lane(texel.xyz, 1u), of_lane(texel.xyz, 2u), slot, lambda_min,
                   faces, instance, entity, best);
      ++slot;
    }
  } while (slot < end);
}

// Where a ray begins that asks for nothing, or for nothing more: beyond everything, so that it enters no box and hits no triangle.
const float beyond_all = 3.4028e38;  // ray.glsl ends every range before it

float begin_of(float lambda_min, Found best) {
#ifdef RAY_ANY
  return best.status == status_hit ? beyond_all : lambda_min;
#else
  return lambda_min;
#endif
}

uint unless_found(uint current, float lambda_min) {
#ifdef RAY_ANY
  return in_any(lambda_min == beyond_all ? 0u : 1u) == 0u ? ref_none : current;
#else
  return current;
#endif
}

// As trace of traverse.glsl, whose loops these are. `asks`: whether the lane has a ray.
Found trace_packet(bool asks, Segment world, float lambda_min, float lambda_max, int t_ns, float share, uint instance_base, uint mask,
                   uint root, float faces, uint two) {
  Found best = nothing_within(asks ? lambda_max : 0.0);
  Search search;
  search.depth = 0u;
  search.rounds = 0u;
  [[unroll]] for (uint word = 0u; word < stack_words; ++word) search.stack[word] = 0u;
  const Seat world_seat = take_seat(subgroupShuffle(world.octant, 0u));
  float world_begin = asks ? lambda_min : beyond_all;
  uint current = root;
  if (current != ref_none) do {
    ++search.rounds;
    current = descend_entities(current, search, share, world_seat, world, world_begin, best.lambda);
    if (current == ref_none) break;
    do {
      search.rounds += 4u;
      if ((current & ref_leaf_bit) != 0u) {
        const uint instance = (current & ref_instance_mask) + instance_base;
        const Instance candidate = instance_at(instance);
        const Segment ray = enter_instance(world, candidate, t_ns);
        const Seat seat = take_seat(subgroupShuffle(ray.octant, 0u));
        const uint bottom = search.depth;
        // A mask shuts out the one ray or the other.
        float begin = (candidate.mask & mask) != 0u ? world_begin : beyond_all;
        current = subgroupShuffle(candidate.blas_root, 0u);
        if (current != ref_none) do {
          ++search.rounds;
          current = descend_geometry(current, search, bottom, seat, ray, begin, best.lambda);
          if (current == ref_none) break;
          do {
            ++search.rounds;
            if ((current & ref_leaf_bit) != 0u) {
              test_run(current, search, ray, begin, faces, instance, candidate.entity, best);
              begin = begin_of(begin, best);
              current = unless_found(pop_geometry(search, bottom, seat.octant), begin);
            }
          } while ((current & ref_leaf_bit) != 0u && current != ref_none);
        } while (current != ref_none);
        search.depth = bottom;
        world_begin = begin_of(world_begin, best);
        current = unless_found(pop_entities(search, world_seat.octant), world_begin);
      }
    } while ((current & ref_leaf_bit) != 0u && current != ref_none);
  } while (current != ref_none);
  bool cut_short = search.rounds >= max_rounds;
#ifdef RAY_ANY
  // A hit is one, whatever was not looked at.
  cut_short = cut_short && best.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(two)) best.status = status_incomplete;
  return best;
}

#endif
