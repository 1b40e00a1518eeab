#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Ray queries for batches of coherent rays: a workgroup is one subgroup, which traces its group's rays eight at a time.
//
// Macros: RAY_ANY, RAY_MOVING (ray/ray.comp).
#include "query/simd8/halt_together.glsl"
#include "query/simd8/packet.glsl"
#include "query/ray/ray_buffers.glsl"

layout(local_size_x = 8) in;

// Whether two rays are worth tracing together: directions within 0.1 rad, origins within a decimetre.
bool runs_beside(vec3 apart, vec3 a, vec3 b) {
  const float along = dot(a, b);
  return largest(apart) <= 0.1 && along > 0.0 && along * along >= 0.99 * dot(a, a) * dot(b, b);
}

// Rays that diverge from the first one are traced as a packet of their own. Where a row of an image ends, eight rays include
// some of the next row: a beam around both would enter most of the world.
Found trace_together(bool asks, TracedRay ray, Entries entries, inout uint rounds, uint allowed) {
  Found found = nothing_within(0.0);
  found.status = status_incomplete;
  const Segment world = make_segment(-ray.origin, ray.direction);
  bool left = asks;
  do {
    const uint first_lane = min_of_lanes(left ? gl_SubgroupInvocationID : 0xFFu) & 7u;
    const vec3 apart = ray.origin - of_lane(ray.origin, first_lane);
    const bool mine = left && runs_beside(apart, ray.direction, of_lane(ray.direction, first_lane));
    const Found now = trace_packet(mine, first_lane, world, ray.lambda_min, ray.lambda_max, ray.t_ns,
                                   ray.share, ray.instance_base, ray.mask, args.root, args.faces,
                                   args.loop_probe, entries, rounds, allowed);
    if (mine) found = now;
    left = left && !mine && gl_SubgroupInvocationID != first_lane;
  } while (in_any(left ? 1u : 0u) != 0u);
  return found;
}

#ifdef RAY_MOVING
Entries entries_of(uint first, uint turns, inout uint rounds) { return Entries(ref_none); }
#else
// Of the rays of all turns.
Entries entries_of(uint first, uint turns, inout uint rounds) {
  const TracedRay lead = read_ray(first);
  Bounds bounds =
      Bounds(lead.direction, lead.direction, -lead.origin, -lead.origin, lead.lambda_min, lead.lambda_max);
  uint turn = 0u;
  do {
    const uint index = first + 8u * turn + gl_SubgroupInvocationID;
    const TracedRay ray = read_ray(index < args.end ? index : first);
    take_in(bounds, ray.direction, -ray.origin, ray.lambda_min, ray.lambda_max);
    ++turn;
  } while (turn < turns);
  rounds += turns;
  return find_entries(of_all_lanes(bounds), lead.direction, lead.t_ns, lead.instance_base, args.root, rounds);
}
#endif

void leave_from(uint place) {
  if (place < args.end) leave(args.halt, place + args.halt_from);
}

void main() {
  const uint first = args.first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * args.per_group;
  if (all_halt(args.halt)) {
    leave_from(first);
    return;
  }
  const uint turns = max(args.per_group / 8u, 1u);
  uint rounds = turns;
  const Entries entries = entries_of(first, turns, rounds);
  uint turn = 0u;
  bool halted;
  do {
    const uint index = first + 8u * turn + gl_SubgroupInvocationID;
    const bool asks = index < args.end;
    // A lane without a ray has a copy of another one, with `asks` false.
    const TracedRay ray = read_ray(asks ? index : first);
    ++turn;
    // Rounds that one packet does not use are available to the next ones.
    const Found found = trace_together(asks, ray, entries, rounds, rounds_at_first * turn);
    if (asks) answer(index, found, ray);
    halted = all_halt(args.halt);
  } while (turn < turns && !halted);
  if (turn < turns) leave_from(first + 8u * turn);
  if (!loops_still_turn(args.loop_probe)) some_left = 1u;
}
