#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Ray queries for batches of coherent rays: a workgroup is one subgroup, which traces its group's rays eight
// at a time.
//
// Macros: RAY_ANY, RAY_MOVING (ray/ray.comp).
#include "query/simd8/halt_together.glsl"
#include "query/simd8/packet.glsl"
#include "query/ray/ray_buffers.glsl"

layout(local_size_x = 8) in;

// Whether two rays are worth tracing together: directions within 0.1 rad, origins within a decimetre.
bool are_coherent(vec3 apart, vec3 a, vec3 b) {
  const float along = dot(a, b);
  return largest(apart) <= 0.1 && along > 0.0 && along * along >= 0.99 * dot(a, a) * dot(b, b);
}

// Rays that diverge from the first one are traced as a packet of their own. Where a row of an image ends,
// eight rays include some of the next row: a beam around both would enter most of the world.
Found trace_together(bool has_ray, TracedRay ray, inout uint rounds, uint allowed) {
  Found found = nothing_within(0.0);
  found.status = status_incomplete;
  const Segment world = make_segment(-ray.origin, ray.direction);
  bool left = has_ray;
  do {
    const uint first_lane = min_of_lanes(left ? gl_SubgroupInvocationID : 0xFFu) & 7u;
    const vec3 apart = ray.origin - of_lane(ray.origin, first_lane);
    const bool mine = left && are_coherent(apart, ray.direction, of_lane(ray.direction, first_lane));
    const Found now =
        trace_packet(mine, first_lane, world, ray.lambda_min, ray.lambda_max, ray.t_ns, ray.share,
                     ray.instance_base, ray.mask, args.root, args.faces, args.loop_probe, rounds, allowed);
    if (mine) found = now;
    left = left && !mine && gl_SubgroupInvocationID != first_lane;
  } while (in_any(left ? 1u : 0u) != 0u);
  return found;
}

void report_unstarted_from(uint place) {
  if (place < args.end) report_unstarted(args.halt, place + args.halt_from);
}

void main() {
  const uint first = args.first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * args.per_group;
  if (subgroup_halts(args.halt)) {
    report_unstarted_from(first);
    return;
  }
  const uint turns = max(args.per_group / 8u, 1u);
  uint rounds = turns;
  uint turn = 0u;
  bool halted;
  do {
    const uint index = first + 8u * turn + gl_SubgroupInvocationID;
    const bool has_ray = index < args.end;
    // A lane without a ray has a copy of another one, with `has_ray` false.
    const TracedRay ray = read_ray(has_ray ? index : first);
    ++turn;
    // Rounds that one packet does not use are available to the next ones.
    const Found found = trace_together(has_ray, ray, rounds, rounds_at_first * turn);
    if (has_ray) answer(index, found, ray);
    halted = subgroup_halts(args.halt);
  } while (turn < turns && !halted);
  if (turn < turns) report_unstarted_from(first + 8u * turn);
  if (!loops_still_turn(args.loop_probe)) some_unanswered = 1u;
}
