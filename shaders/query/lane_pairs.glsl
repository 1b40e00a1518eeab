// Rays that go their own ways, by two lanes each: a subgroup of eight has four rays at hand. Each lane of a pair tests half of a node's
// children and every other triangle of a leaf. So fewer rays wait for one another than where each lane has its own, in half as long a
// visit; and as nothing differs from lane to lane but what they test, nodes are fetched by both together, words are handed over by
// shuffles, the stack lies in registers, and no line is run lane by lane.
//
// Both lanes go the same way always: what a loop or a stack is led by comes from both. Triangles are tested by the lines of
// ray_triangle.glsl, so answers have the bits of traverse.glsl's.
//
// For subgroups of eight lanes, all of them in use. Include with RAY_ANY or RAY_MOVING defined as for traverse.glsl.
#ifndef RTSTDB_QUERY_LANE_PAIRS_GLSL
#define RTSTDB_QUERY_LANE_PAIRS_GLSL
#include "common/loops.glsl"
#include "query/lanes.glsl"
#include "query/ray_images.glsl"
#include "query/ray_slabs.glsl"

// Groups of a ray: one a level of the trees, where some of its children wait. With the last of them the search is cut short.
const uint stack_words = 8u;
const uint stack_size = 2u * stack_words;

uint half_of_pair() { return gl_SubgroupInvocationID & 1u; }

// Of the pair's lanes, 0 and 1.
uint of_half(uint v, uint half_of) { return of_lane(v, (gl_SubgroupInvocationID & 6u) | half_of); }
uvec4 of_half(uvec4 v, uint half_of) { return of_lane(v, (gl_SubgroupInvocationID & 6u) | half_of); }

uint of_both(uint bits) { return bits | of_lane(bits, gl_SubgroupInvocationID ^ 1u); }

// What is left of a search: groups of children, each of one node; the node in the upper 24 bits, below it one bit a child, in the order
// in which the ray comes by them: bit i is slot i ^ octant. Group k of the stack is in half k & 1 of word k >> 1.
struct Search {
  uint depth;
  uint rounds;
  uint stack[stack_words];
};

Search nothing_begun() {
  Search search;
  search.depth = 0u;
  search.rounds = 0u;
  [[unroll]] for (uint word = 0u; word < stack_words; ++word) search.stack[word] = 0u;
  return search;
}

// The group on top of the stack; where none is left above `bottom`, one of a node that there is.
uint top_of(Search search, uint bottom) {
  const uint top = search.depth - 1u;
  uint waiting = search.stack[0];
  [[unroll]] for (uint word = 1u; word < stack_words; ++word) waiting = top >> 1 == word ? search.stack[word] : waiting;
  waiting = of_half(waiting, top & 1u);
  return search.depth == bottom ? 0u : waiting;
}

// The lane's texel of a node's references.
int references_texel(uint node, uint texels) { return int(node * texels + 4u + half_of_pair()); }

// The next child, or ref_none when nothing is left above `bottom`: of the group at hand, or of `waiting`, that on top of the stack.
// The references of both are there before it is known which goes on.
uint take_next(inout Search search, uint at_hand, uvec4 references, uint waiting, uvec4 waiting_references, uint bottom, uint octant) {
  const bool pop = (at_hand & 0xFFu) == 0u;
  const bool done = pop && search.depth == bottom;
  search.depth -= pop && !done ? 1u : 0u;
  const uint group = pop ? waiting : at_hand;
  const uint rest = group & (group - 1u);
  // The exponent of a power of two is the place of its bit.
  const uint slot = (uint(floatBitsToInt(float(int(group ^ rest))) >> 23) - 127u) ^ octant;
  const uint kept_in = (search.depth & 1u) == half_of_pair() ? search.depth >> 1 : stack_words;
  [[unroll]] for (uint word = 0u; word < stack_words; ++word) search.stack[word] = kept_in == word ? rest : search.stack[word];
  search.depth += (rest & 0xFFu) != 0u && !done ? 1u : 0u;
  search.rounds += search.depth == stack_size ? max_rounds : 0u;
  const uvec4 refs = pop ? waiting_references : references;
  const uint low = (slot & 1u) != 0u ? refs.y : refs.x;
  const uint high = (slot & 1u) != 0u ? refs.w : refs.z;
  const uint reference = of_half((slot & 2u) != 0u ? high : low, slot >> 2 & 1u);
  return done || search.rounds >= max_rounds ? ref_none : reference;
}

uint next_of_entities(inout Search search, uint octant) {
  const uint waiting = top_of(search, 0u);
  const uvec4 references = imageLoad(tlas, references_texel(waiting >> 8, tlas_node_texels));
  return take_next(search, 0u, references, waiting, references, 0u, octant);
}

uint next_of_geometry(inout Search search, uint bottom, uint octant) {
  const uint waiting = top_of(search, bottom);
  const uvec4 references = imageLoad(nodes, references_texel(waiting >> 8, node_texels));
  return take_next(search, 0u, references, waiting, references, bottom, octant);
}

// The edges of the lane's four children along an axis, as those that the ray meets first and last.
uvec2 edges_along(uvec4 edges, bool backwards) {
  const uvec2 own = half_of_pair() == 0u ? edges.xz : edges.yw;
  return backwards ? own.yx : own;
}

// The bit of the lane's child k in a group, where the ray enters it. `used`: the slots that have a child; the box of an empty one is
// inside out, which a distant ray may not notice.
uint bit_of(bool enters_it, uint used, uint k, uint octant) {
  const uint slot = 4u * half_of_pair() + k;
  return enters_it && (used & 1u << slot) != 0u ? 1u << (slot ^ octant) : 0u;
}

// The children of a node that the ray enters, as bits of a group. The lanes of a pair have the head and the edges along x in
// `head_and_x`, those along y and z in `y_and_z`.
uint children_entered(uvec4 head_and_x, uvec4 y_and_z, Segment ray, bool of_entities, float lambda_min, float limit) {
  const uvec4 head = of_half(head_and_x, 0u);
  const Slabs slabs = slabs_of(head, ray, of_entities ? blur_of(head, ray) : ray.blur_m, lambda_min, limit);
  const uvec2 x = edges_along(of_half(head_and_x, 1u), slabs.backwards.x);
  const uvec2 y = edges_along(of_half(y_and_z, 0u), slabs.backwards.y);
  const uvec2 z = edges_along(of_half(y_and_z, 1u), slabs.backwards.z);
  uint entered = 0u;
  [[unroll]] for (uint k = 0u; k < 4u; ++k) {
    const vec3 near = vec3(quanta_of(x.x, k), quanta_of(y.x, k), quanta_of(z.x, k));
    const vec3 far = vec3(quanta_of(x.y, k), quanta_of(y.y, k), quanta_of(z.y, k));
    entered |= bit_of(enters(slabs, near, far), head.w >> 24, k, ray.octant);
  }
  return of_both(entered);
}

#ifdef RAY_MOVING
// The same for entities; `share`: of the window that has passed when the ray asks. Edges at its end along x and y lie in
// `end_x_and_y`, in each lane those along z in `end_z`.
uint entities_entered(uvec4 head_and_x, uvec4 y_and_z, uvec4 end_x_and_y, uvec4 end_z, float share, Segment ray, float lambda_min,
                      float limit) {
  const uvec4 head = of_half(head_and_x, 0u);
  const Slabs slabs = slabs_of(head, ray, blur_of(head, ray), lambda_min, limit);
  const uvec2 begin[3] = uvec2[](edges_along(of_half(head_and_x, 1u), slabs.backwards.x),
                                 edges_along(of_half(y_and_z, 0u), slabs.backwards.y),
                                 edges_along(of_half(y_and_z, 1u), slabs.backwards.z));
  const uvec2 end[3] = uvec2[](edges_along(of_half(end_x_and_y, 0u), slabs.backwards.x),
                               edges_along(of_half(end_x_and_y, 1u), slabs.backwards.y), edges_along(end_z, slabs.backwards.z));
  uint entered = 0u;
  [[unroll]] for (uint k = 0u; k < 4u; ++k) {
    vec3 near;
    vec3 far;
    [[unroll]] for (int axis = 0; axis < 3; ++axis) {
      near[axis] = quanta_at(begin[axis].x, end[axis].x, k, share);
      far[axis] = quanta_at(begin[axis].y, end[axis].y, k, share);
    }
    entered |= bit_of(enters(slabs, near, far), head.w >> 24, k, ray.octant);
  }
  return of_both(entered);
}
#endif

// Down the entities' tree to the next instance, or none.
uint descend_entities(uint node, inout Search search, float share, Segment world, float lambda_min, float limit) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      const uint waiting = top_of(search, 0u);
      const int base = int(current * tlas_node_texels + half_of_pair());
      const uvec4 head_and_x = imageLoad(tlas, base);
      const uvec4 y_and_z = imageLoad(tlas, base + 2);
#ifdef RAY_MOVING
      const uvec4 end_z = imageLoad(tlas, int(current * tlas_node_texels + 8u));
      const uint entered =
          entities_entered(head_and_x, y_and_z, imageLoad(tlas, base + 6), end_z, share, world, lambda_min, limit);
#else
      // All of them are where they are at the window's begin, which is its end.
      const uint entered = children_entered(head_and_x, y_and_z, world, true, lambda_min, limit);
#endif
      current = take_next(search, current << 8 | entered, imageLoad(tlas, references_texel(current, tlas_node_texels)), waiting,
                          imageLoad(tlas, references_texel(waiting >> 8, tlas_node_texels)), 0u, world.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

// The same down a geometry's tree, above `bottom` of the stack, to a run of triangles.
uint descend_geometry(uint node, inout Search search, uint bottom, Segment ray, float lambda_min, float limit) {
  uint current = node;
  do {
    ++search.rounds;
    if ((current & ref_leaf_bit) == 0u) {
      const uint waiting = top_of(search, bottom);
      const int base = int(current * node_texels + half_of_pair());
      const uint entered = children_entered(imageLoad(nodes, base), imageLoad(nodes, base + 2), ray, false, lambda_min, limit);
      current = take_next(search, current << 8 | entered, imageLoad(nodes, references_texel(current, node_texels)), waiting,
                          imageLoad(nodes, references_texel(waiting >> 8, node_texels)), bottom, ray.octant);
    }
  } while ((current & ref_leaf_bit) == 0u);
  return current;
}

// Each lane has the nearest hit of its own triangles. Rounds are counted as a lane would make them that has the ray for itself: what
// is answered here would be answered there, so it does not depend on who else asks.
void test_run(uint run, inout Search search, Segment ray, float lambda_min, float faces, uint last_kept, uint instance, uint entity,
              inout Found best) {
  uint first = run & ref_triangle_first_mask;
  const uint end = first + (run >> ref_triangle_count_shift & 0xFu) + 1u;
  search.rounds += end - first;
  do {
    const uint slot = first + half_of_pair();
    if (slot < end) {
      const int base = int(slot * triangle_texels);
      test_corners(ray, triangle_texel(base), triangle_texel(base + 1), triangle_texel(base + 2).xyz, slot, lambda_min, faces,
                   instance, entity, best);
    }
    first += 2u;
  } while (first < end);
}

// That of the nearer hit; neither is negative.
float reach(Found best) {
  const int own = floatBitsToInt(reach_of(best));
  return intBitsToFloat(min(own, of_lane(own, gl_SubgroupInvocationID ^ 1u)));
}

uint unless_found(uint current, Found best) {
#ifdef RAY_ANY
  return of_both(best.status) == status_hit ? ref_none : current;
#else
  return current;
#endif
}

#include "query/trace.glsl"

Found of_lane(Found found, uint lane) {
  return Found(of_lane(found.status, lane), of_lane(found.lambda, lane), of_lane(found.u, lane), of_lane(found.v, lane),
               of_lane(found.instance, lane), of_lane(found.entity, lane), of_lane(found.triangle, lane), of_lane(found.slot, lane),
               of_lane(found.front ? 1u : 0u, lane) != 0u);
}

// What a pair has found, in both its lanes: the nearest; where the search was cut short, it was for both.
Found of_pair(Found own) {
  const Found other = of_lane(own, gl_SubgroupInvocationID ^ 1u);
  const bool precedes = other.lambda < own.lambda ||
                        (other.lambda == own.lambda &&
                         (other.entity < own.entity || (other.entity == own.entity && other.triangle < own.triangle)));
  Found nearest = own;
  if (other.status == status_hit && (own.status != status_hit || precedes)) nearest = other;
  return nearest;
}

#endif
