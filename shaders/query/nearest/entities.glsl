// The search for entities by their centres or bounds, which needs the TLAS alone. Part of nearest.comp.
//
// Visits a node's entities at once, then its nearest inner child. The other children go on the stack as one
// group and are measured again when the group is popped, with the reach of that time; a group that is out of
// reach as a whole is skipped.
#ifndef RTSTDB_QUERY_NEAREST_ENTITIES_GLSL
#define RTSTDB_QUERY_NEAREST_ENTITIES_GLSL

// A group is the unvisited children of one node: the node in the upper 24 bits, below it one bit per child.
// The stack holds at most one group per level of the tree.
const uint stack_size = 96u;
uint groups[stack_size];
float squares[stack_size];  // distance to the nearest child of each group, squared

uint lowest_bit(uint mask) { return mask & (~mask + 1u); }

// The exponent of a power of two is the index of its bit.
uint place_of_bit(uint bit) { return (floatBitsToUint(float(int(bit))) >> 23) - 127u; }

uint reference_in(MotionNode wide, uint slot) {
  const uvec4 refs = (slot & 4u) != 0u ? wide.begin.references[1] : wide.begin.references[0];
  const uvec2 pair = (slot & 2u) != 0u ? refs.zw : refs.xy;
  return (slot & 1u) != 0u ? pair.y : pair.x;
}

// From the node's origin to the point, in the node's quanta, which are powers of two.
vec3 in_quanta(MotionNode wide, vec3 point) {
  precise vec3 from = point - wide.begin.origin;
  return from * uintBitsToFloat(0x7F000000u - floatBitsToUint(wide.begin.quantum));
}

// The squared distance to a child's box, enlarged by the node's overhang. Maxima of floats are taken as
// integers: positive floats have the order of their bits, and negative values do not matter here.
float child_square(MotionNode wide, uint k, vec3 from) {
  const vec3 lo = vec3(edge_at(wide, 0u, 0u, k), edge_at(wide, 1u, 0u, k), edge_at(wide, 2u, 0u, k));
  const vec3 hi = vec3(edge_at(wide, 0u, 2u, k), edge_at(wide, 1u, 2u, k), edge_at(wide, 2u, 2u, k));
  const ivec3 outside = max(max(floatBitsToInt(lo - from), floatBitsToInt(from - hi)), ivec3(0));
#ifdef NEAREST_STILL
  const vec3 gap = intBitsToFloat(outside) * wide.begin.quantum;
#else
  // A relative 1e-6 for the cancellation in the difference of two large numbers.
  const vec3 gap = max(intBitsToFloat(outside) * wide.begin.quantum * 0.999999 - wide.overhang, vec3(0.0));
#endif
  return dot(gap, gap);
}

// The entities among a node's children.
void look_at_entities(MotionNode wide, uint leaves, NearestRecord record, vec3 point) {
  if (leaves != 0u) do {
      ++rounds;
      if (leaves != 0u) {
        const uint bit = lowest_bit(leaves);
        leaves ^= bit;
        const uint visible = reference_in(wide, place_of_bit(bit)) & ref_instance_mask;
        const uint place = visible + record.instance_base;
#ifdef NEAREST_STILL
        const vec4 center = texelFetch(centers, int(visible * still_center_texels));
        const uint mask = floatBitsToUint(center.w);
        precise vec3 offset = center.xyz - point;
#else
        Instance i = fetch_instance(instances, place);
        fetch_instance_box(instances, place, i);
        const uint mask = i.mask;
        const vec3 offset = offset_to(i, record.t_ns, point);
#endif
        const bool wanted = (mask & record.mask) != 0u && visible != record.excluded;
        offer(Candidate(wanted ? length(offset) : nowhere, wanted ? place : no_entity, 0u, 0u));
      }
    } while (leaves != 0u);
}

void search_entities(NearestRecord record, vec3 point) {
  uint group = args.root << 8 | 0xFFu;
  bool done = args.root == ref_none;
  if (!done) do {
      rounds += 2u;  // this loop's, and one for that inside
      if (!done) {
        const MotionNode wide = fetch_motion_node(tlas, group >> 8, record.share);
        const vec3 from = in_quanta(wide, point);
        uint leaves = 0u;
        uint inner = 0u;
        uint nearest = 0u;
        float nearest_square = nowhere;
        float waiting_square = nowhere;
        [[unroll]] for (uint k = 0u; k < 8u; ++k) {
          const float square = child_square(wide, k, from);
          const uint bit = square <= box_limit ? group & 1u << k : 0u;
          const bool leaf = !is_inner(child_reference(wide, k));
          const float inner_square = leaf || bit == 0u ? nowhere : square;
          const bool nearer = inner_square < nearest_square;
          leaves |= leaf ? bit : 0u;
          inner |= leaf ? 0u : bit;
          nearest = nearer ? bit : nearest;
          const int behind = max(floatBitsToInt(nearest_square), floatBitsToInt(inner_square));
          waiting_square = intBitsToFloat(min(floatBitsToInt(waiting_square), behind));
          nearest_square = nearer ? square : nearest_square;
        }
        leaves &= wide.used;  // an empty slot counts as a leaf
        look_at_entities(wide, leaves, record, point);
        inner = nearest_square <= box_limit ? inner : 0u;  // the entities above may have shortened the reach
        nearest &= inner;
        const uint rest = (group & ~0xFFu) | (inner ^ nearest);
        groups[depth] = rest;
        squares[depth] = waiting_square;
        depth += (rest & 0xFFu) != 0u ? 1u : 0u;
        // One group per iteration: an inner loop over groups out of reach costs more than it saves.
        depth -= depth != 0u && squares[max(depth, 1u) - 1u] > box_limit ? 1u : 0u;
        const uint waiting = groups[max(depth, 1u) - 1u];
        const bool pop = inner == 0u;
        done = pop && depth == 0u;
        depth -= pop && !done ? 1u : 0u;
        group = pop ? waiting : reference_in(wide, place_of_bit(max(nearest, 1u))) << 8 | 0xFFu;
        cut_short = cut_short || depth == stack_size || rounds > max_rounds;
      }
    } while (!done && !cut_short);
}

#endif
