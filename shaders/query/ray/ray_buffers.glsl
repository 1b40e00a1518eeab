// How every ray kernel reads a ray and writes its hit. rtstdb/query.hpp defines the fields.
//
// Included after the traversal (traverse.glsl, simd8/packet.glsl or simd8/work_sharing.glsl). Macros:
// RAY_ANY, RAY_MOVING (ray.comp).
#include "common/halt.glsl"
#include "common/pairs.glsl"
#include "common/places.glsl"
#include "query/ray/ray_args.glsl"
#include "query/ray/traced_ray.glsl"

layout(set = 0, binding = 4) uniform usamplerBuffer identities;
layout(set = 0, binding = 5) uniform samplerBuffer rays;
layout(set = 0, binding = 6, scalar) writeonly buffer IncompleteBuffer {
  uint some_incomplete;
  // Set where loops have stopped (common/loops.glsl) in a subgroup that processes all rays of its group: some
  // have no answer. The subgroup's own limit of iterations should prevent this.
  uint some_unanswered;
  uint some_paused;
};
#ifdef RAY_MOVING
layout(set = 0, binding = 7, scalar) readonly buffer PlacesBuffer { uint places[]; };
#endif

Destination destination_of_hit(uint place) { return destination_of(args.hits, place, 8u * hit_pairs); }

TracedRay read_ray(uint index) {
  const int base = int(index * ray_texels);
  const vec4 r0 = texelFetch(rays, base);
  const vec4 r1 = texelFetch(rays, base + 1);
  const vec4 r2 = texelFetch(rays, base + 2);
  const uint at_ns = args.still != 0u ? args.still_ns : floatBitsToUint(r2.x);
  const uint since_epoch_ns = at_ns - args.epoch_ns;
  const bool late = since_epoch_ns >= epoch_length_ns;
  TracedRay ray;
  ray.t_ns = int(late ? since_epoch_ns - epoch_length_ns : since_epoch_ns);
  ray.instance_base = late ? args.late_base : 0u;
  ray.share = clamp(float(at_ns - args.window_begin_ns) * args.per_window_ns, 0.0, 1.0);
  ray.origin = r0.xyz;
  ray.direction = vec3(r0.w, r1.xy);
  ray.v_origin = vec3(0.0);
  ray.lambda_min = r1.z;
  ray.lambda_max = r1.w;
#ifdef RAY_MOVING
  const uint carrier = floatBitsToUint(r2.w);
  if (carrier != no_entity) { carry(instance_at(places[carrier] + ray.instance_base), ray); }
#endif
  scale_direction(ray);
  ray.mask = floatBitsToUint(r2.z);
  return ray;
}

void write_hit(uint place, Found found, TracedRay ray) {
  const bool hit = found.status == status_hit;
  const Instance i = instance_at(hit ? found.instance : 0u);
  const int corners = int(found.slot * triangle_texels);
  const vec3 n_world = world_normal(i, ray.t_ns, triangle_texel(corners).xyz, triangle_texel(corners + 1).xyz,
                                    triangle_texel(corners + 2).xyz);
  const vec3 v_relative_mps =
      velocity_at(i, ray.t_ns, ray.origin + found.lambda * ray.direction) - ray.v_origin;
  const uvec4 identity = texelFetch(identities, int(hit ? found.entity : 0u));
  const uvec2 nothing = uvec2(0u);
  const Destination to = destination_of_hit(place);
  store_pair(to, 0u, uvec2(found.status, hit ? floatBitsToUint(found.lambda * ray.unit) : 0u));
  store_pair(to, 1u, hit ? floatBitsToUint(vec2(found.u, found.v)) : nothing);
  store_pair(to, 2u, hit ? identity.xy : uvec2(no_entity, 0u));
  store_pair(to, 3u, hit ? identity.zw : nothing);
  store_pair(to, 4u, hit ? uvec2(found.triangle, found.front ? 1u : 0u) : nothing);
  store_pair(to, 5u, hit ? floatBitsToUint(n_world.xy) : nothing);
  store_pair(to, 6u, hit ? floatBitsToUint(vec2(n_world.z, v_relative_mps.x)) : nothing);
  store_pair(to, 7u, hit ? floatBitsToUint(v_relative_mps.yz) : nothing);
}

void answer(uint place, Found found, TracedRay ray) {
#ifdef RAY_ANY
  // The rest of the hit keeps its initial value.
  store_pair(destination_of_hit(place), 0u, uvec2(found.status, 0u));
#else
  write_hit(place, found, ray);
#endif
  if (found.status == status_incomplete) some_incomplete = 1u;
}
