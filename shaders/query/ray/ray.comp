#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Ray queries, one ray per lane.
//
// Macros:
//   RAY_ANY     a ray stops at its first hit
//   RAY_MOVING  rays have different times, or some move with a carrier; this variant also retries rays that
//               were cut short, in as many dispatches as they take
//   RAY_LIST=n  keeps up to n hits of each ray
#ifdef RAY_MOVING
#define RAY_PAUSES
#endif
#include "query/ray/traverse.glsl"
#include "query/ray/ray_buffers.glsl"
#ifdef RAY_PAUSES
#include "query/ray/pause.glsl"
#endif

layout(local_size_x = 64) in;

#ifdef RAY_LIST
void answer_list(uint index, Found found, TracedRay ray) {
  for (uint k = 0u; k < args.hits_per_ray; ++k) {
    Found one = nothing_within(ray.lambda_max);
    if (found.status == status_incomplete) one.status = status_incomplete;
    if (found.status != status_incomplete && list_entity[k] != no_entity) {
      const Instance candidate = instance_at(list_instance[k]);
      const Segment segment = enter_instance(make_segment(-ray.origin, ray.direction), candidate, ray.t_ns,
                                             head_of(candidate.blas_root));
      test_triangle(segment, list_slot[k], ray.lambda_min, args.faces, list_instance[k], list_entity[k], one);
    }
    write_hit(index * args.hits_per_ray + k, one, ray);
  }
  if (found.status == status_incomplete) some_incomplete = 1u;
}
#endif

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  // A lane without a ray of its own takes part in the loops of its subgroup with a copy of another ray.
  bool has_ray = place < args.end;
  if (has_ray && skips_when_halted(args.halt, place + args.halt_from)) has_ray = false;
  const uint kept_at = has_ray ? place : args.first;
#ifdef RAY_PAUSES
  const bool is_retry = args.is_retry != 0u;
  const uint index = is_retry ? retried_ray(kept_at) : kept_at;
#else
  const uint index = kept_at;
#endif
  const TracedRay ray = read_ray(index);
#ifdef RAY_LIST
  clear_list();
#endif
#ifdef RAY_PAUSES
  const bool resumes = is_retry && !begins_again(kept_at);
  if (resumes && paused[pause_at(kept_at)] == 0u) has_ray = false;
  TraversalState state = begin_traversal(has_ray ? args.root : ref_none, ray.lambda_max);
  if (has_ray && resumes) pause_or_resume(true, kept_at, state);
#else
  TraversalState state = begin_traversal(has_ray ? args.root : ref_none, ray.lambda_max);
#endif
  trace(state, make_segment(-ray.origin, ray.direction), ray.lambda_min, ray.t_ns, ray.share,
        ray.instance_base, ray.mask, args.faces, args.hits_per_ray - 1u);
  const Found found = found_by(state, args.loop_probe);
  if (!has_ray) return;
#ifdef RAY_PAUSES
  const bool goes_on = is_retry && is_unfinished(state) && found.status != status_incomplete;
  if (goes_on) {
    pause_or_resume(false, kept_at, state);
    some_paused = 1u;
    return;
  }
  if (is_retry) paused[pause_at(kept_at)] = 0u;
#endif
#ifdef RAY_LIST
  answer_list(index, found, ray);
#else
  answer(index, found, ray);
#endif
}
