// The body of the ray queries for rays by a lane each.
//
// Include with RAY_ANY or RAY_MOVING defined as for ray.glsl, RAY_LIST as the largest number of hits of each, where that is more than
// one.
#include "query/traverse.glsl"
#include "query/ray.glsl"

layout(local_size_x = 64) in;

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  // Who has no place runs along for the others of its subgroup, with a ray that there is.
  const bool asks = place < args.end;
  const uint index = ray_at(asks ? place : args.first);
  const Asked ray = read_ray(index);
#ifdef RAY_LIST
  clear_list();
#endif
  const Found found = trace(make_segment(-ray.origin, ray.direction), ray.lambda_min, ray.lambda_max, ray.t_ns, ray.share,
                            ray.instance_base, ray.mask, asks ? args.root : ref_none, args.faces, args.hits_per_ray - 1u, args.two);
  if (!asks) return;
#ifdef RAY_LIST
  for (uint k = 0u; k < args.hits_per_ray; ++k) {
    Found one = nothing_within(ray.lambda_max);
    if (found.status == status_incomplete) one.status = status_incomplete;
    if (found.status != status_incomplete && list_entity[k] != no_entity) {
      const Instance candidate = instance_at(list_instance[k]);
      const Segment segment =
          enter_instance(make_segment(-ray.origin, ray.direction), candidate, ray.t_ns, head_of(candidate.blas_root));
      test_triangle(segment, list_slot[k], ray.lambda_min, args.faces, list_instance[k], list_entity[k], one);
    }
    write_hit(index * args.hits_per_ray + k, one, ray);
  }
  if (found.status == status_incomplete) some_incomplete = 1u;
#else
  answer(index, found, ray);
#endif
}
