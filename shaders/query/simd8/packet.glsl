// Packets: eight coherent rays that one subgroup traverses together (Wald, Slusallek, Benthin and Wagner
// 2001). Each lane has a ray; all lanes visit every child that the beam around the rays enters. Addresses and
// branches are the same for all lanes, so a node is fetched once, each lane decodes and tests one child, and
// the stack is spread over the lanes of a few words. Each ray tests triangles by itself, so answers have the
// same bits as those of ray/traverse.glsl.
//
// For subgroups of eight lanes, all of them active. Rays that diverge make the packet slow:
// rtstdb/query/ray/ray_coherence.hpp decides which batches come here.
//
// Macros: RAY_ANY, RAY_MOVING (ray/ray.comp).
#ifndef RTSTDB_QUERY_SIMD8_PACKET_GLSL
#define RTSTDB_QUERY_SIMD8_PACKET_GLSL
#include "query/simd8/beam.glsl"
#include "query/simd8/lanes.glsl"
#include "query/simd8/ray_images.glsl"
#include "query/ray/ray_args.glsl"
#include "query/ray/rounds.glsl"
#include "query/ray/ray_triangle.glsl"

// At most one group per level of the trees, one lane per group.
const uint stack_words = 3u;
const uint stack_size = 8u * stack_words;

// The state of a search. A group is the unvisited children of one node: the node in the upper 24 bits, below
// it one bit per lane of a child. Group k of the stack is in lane k & 7 of word k >> 3.
struct Search {
  uint depth;
  uint rounds;   // loop iterations of the subgroup so far
  uint allowed;  // the limit of rounds, where the search is cut short
  uint stack[stack_words];
};

Search nothing_begun(uint rounds, uint allowed) {
  Search search;
  search.depth = 0u;
  search.rounds = rounds;
  search.allowed = allowed;
  [[unroll]] for (uint word = 0u; word < stack_words; ++word) search.stack[word] = 0u;
  return search;
}

// The group on top of the stack; where none is left above `bottom`, a group of some existing node.
uint top_of(Search search, uint bottom) {
  const uint top = search.depth - 1u;
  const uint low = of_lane(search.stack[0], top & 7u);
  const uint middle = of_lane(search.stack[1], top & 7u);
  const uint high = of_lane(search.stack[2], top & 7u);
  return search.depth == bottom ? 0u : top < 8u ? low : top < 16u ? middle : high;
}

// The texel that a lane loads: one of the node, whose references are in texels 4 and 5; in lanes 6 and 7 the
// references of `waiting`, the node on top of the stack. Both are loaded together, before it is known which
// node comes next.
int lane_texel(uint node, uint waiting, uint texels) {
  const uint lane = gl_SubgroupInvocationID;
  return int(lane < 6u ? node * texels + lane : waiting * texels + lane - 2u);
}

// The next child to visit, of those just entered or else of the group on top of the stack; ref_none when none
// is left above `bottom`.
uint take_next(inout Search search, uvec4 texels, uint node, uint entered, uint waiting, uint bottom,
               uint octant) {
  const bool pop = entered == 0u;
  const bool done = pop && search.depth == bottom;
  const bool spent = search.rounds >= search.allowed;
  search.depth -= pop && !done ? 1u : 0u;
  const uint group = pop ? waiting : node << 8 | entered;
  const uint rest = group & (group - 1u);
  // The exponent of a power of two is the index of its bit.
  const uint slot = (uint(floatBitsToInt(float(int(group ^ rest))) >> 23) - 127u) ^ octant;
  [[unroll]] for (uint word = 0u; word < stack_words; ++word) {
    search.stack[word] = gl_SubgroupInvocationID + 8u * word == search.depth ? rest : search.stack[word];
  }
  search.depth += (rest & 0xFFu) != 0u && !done ? 1u : 0u;
  search.allowed = search.depth == stack_size ? 0u : search.allowed;
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

// Goes down the TLAS to the next instance, or to ref_none.
uint descend_entities(uint node, inout Search search, vec2 shares, ChildLane child_lane, Beam beam,
                      Range range) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      const uint waiting = top_of(search, 0u);
      const uvec4 texels = imageLoad(tlas, lane_texel(current, waiting >> 8, tlas_node_texels));
#ifdef RAY_MOVING
      const uvec4 ends =
          imageLoad(tlas, int(current * tlas_node_texels + 5u + clamp(gl_SubgroupInvocationID, 1u, 3u)));
      const uint entered = entities_entered(texels, ends, child_lane, shares, beam, range);
#else
      const uint entered =
          children_entered(texels, child_lane, beam, blur_of(of_lane(texels, 0u), beam), range);
#endif
      current = take_next(search, texels, current, entered, waiting, 0u, child_lane.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

// Goes down a geometry's tree to a leaf, using the stack above `bottom`.
uint descend_geometry(uint node, inout Search search, uint bottom, ChildLane child_lane, Beam beam,
                      Range range) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      const uint waiting = top_of(search, bottom);
      const uvec4 texels = imageLoad(nodes, lane_texel(current, waiting >> 8, node_texels));
      const uint entered = children_entered(texels, child_lane, beam, 0.0, range);
      current = take_next(search, texels, current, entered, waiting, bottom, child_lane.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

void test_run(uint run, inout Search search, Segment ray, float lambda_min, float faces, uint instance,
              uint entity, inout Found best) {
  const uint first = run & ref_triangle_first_mask;
  const uint end = first + (run >> ref_triangle_count_shift & 0xFu) + 1u;
  uint slot = first;
  do {
    ++search.rounds;
    if (slot < end) {
      const vec4 texel = triangle_texel(int(slot * triangle_texels + min(gl_SubgroupInvocationID, 2u)));
      const float number = of_lane(texel.w, 0u);
      test_corners(ray, vec4(of_lane(texel.xyz, 0u), number),
                   vec4(of_lane(texel.xyz, 1u), of_lane(texel.w, 1u)), of_lane(texel.xyz, 2u), slot,
                   lambda_min, faces, instance, entity, best);
      ++slot;
    }
  } while (slot < end);
}

// lambda_min of a ray that is complete, or of a lane without a ray: it enters no box and hits no triangle.
const float beyond_all = 3.4028e38;  // ray_buffers.glsl ends every range before it

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

// The loops of trace in ray/traverse.glsl, for a packet. `has_ray`: whether the lane's ray belongs to the
// packet; `first_lane` has one. `rounds`: of the subgroup so far, at most `allowed`.
Found trace_packet(bool has_ray, uint first_lane, Segment world, float lambda_min, float lambda_max, int t_ns,
                   float share, uint instance_base, uint mask, uint root, float faces, uint loop_probe,
                   inout uint rounds, uint allowed) {
  Found best = nothing_within(has_ray ? lambda_max : 0.0);
  Search search = nothing_begun(rounds + 8u, allowed);  // including the loops around and after this one
  const ChildLane world_child_lane = child_lane_of(of_lane(world.octant, first_lane));
  const Beam world_beam = beam_of(has_ray, world);
  const vec2 shares = vec2(min_of_lanes(has_ray ? share : 1.0), max_of_lanes(has_ray ? share : 0.0));
  float world_begin = has_ray ? lambda_min : beyond_all;
  Range world_range = range_of(world_begin, reach_of(best));
  uint current = root;
  if (current != ref_none) do {
      ++search.rounds;
      current = descend_entities(current, search, shares, world_child_lane, world_beam, world_range);
      if (current == ref_none) break;
      do {
        search.rounds += 5u;
        if ((current & ref_leaf_bit) != 0u) {
          const uint instance = (current & ref_instance_mask) + instance_base;
          const Instance candidate = instance_at(instance);
          const Segment ray = enter_instance(world, candidate, t_ns, head_of(candidate.blas_root));
          const ChildLane child_lane = child_lane_of(of_lane(ray.octant, first_lane));
          const Beam beam = beam_of(has_ray, ray);
          const uint bottom = search.depth;
          // The mask excludes some rays.
          float begin = (candidate.mask & mask) != 0u ? world_begin : beyond_all;
          Range range = range_of(begin, reach_of(best));
          current = of_lane(candidate.blas_root, first_lane);
          if (current != ref_none) do {
              ++search.rounds;
              current = descend_geometry(current, search, bottom, child_lane, beam, range);
              if (current == ref_none) break;
              do {
                ++search.rounds;
                if ((current & ref_leaf_bit) != 0u) {
                  test_run(current, search, ray, begin, faces, instance, candidate.entity, best);
                  begin = begin_of(begin, best);
                  range = range_of(begin, reach_of(best));
                  current = unless_found(pop_geometry(search, bottom, child_lane.octant), begin);
                }
              } while ((current & ref_leaf_bit) != 0u && current != ref_none);
            } while (current != ref_none);
          search.depth = bottom;
          world_begin = begin_of(world_begin, best);
          world_range = range_of(world_begin, reach_of(best));
          current = unless_found(pop_entities(search, world_child_lane.octant), world_begin);
        }
      } while ((current & ref_leaf_bit) != 0u && current != ref_none);
    } while (current != ref_none);
  bool cut_short = search.rounds >= search.allowed;
#ifdef RAY_ANY
  // A hit is a valid answer also where the search was cut short.
  cut_short = cut_short && best.status == status_miss;
#endif
  if (cut_short || !loops_still_turn(loop_probe)) best.status = status_incomplete;
  rounds = search.rounds;
  return best;
}

#endif
