// The body of the ray queries: reads a ray, traces it, writes the hit. See rtstdb/query.hpp for what the fields mean.
//
// Include with RAY_ANY defined for rays that stop at the first hit, RAY_MOVING where they ask at different instants or
// some of them move with an entity, RAY_LIST as the largest number of hits of each, where that is more than one, RAY_PACKET
// where eight neighbours run side by side.
#include "common/interleave.glsl"
#ifdef RAY_PACKET
#include "query/packet.glsl"
#else
#include "query/traverse.glsl"
#endif

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RayArgs args; };
layout(set = 0, binding = 4) uniform usamplerBuffer identities;
layout(set = 0, binding = 5) uniform samplerBuffer rays;
layout(set = 0, binding = 6) uniform usamplerBuffer again;
layout(set = 0, binding = 7, rgba32ui) writeonly uniform uimageBuffer hits;
layout(set = 0, binding = 8, scalar) writeonly buffer IncompleteBuffer { uint some_incomplete; };
#ifdef RAY_MOVING
layout(set = 0, binding = 9, scalar) readonly buffer PlacesBuffer { uint places[]; };
#endif

float largest(vec3 p) { return max(max(abs(p.x), abs(p.y)), abs(p.z)); }

vec3 velocity_at(Instance i, int t_ns, vec3 point) { return i.v + cross(i.w, point - position_of(i, t_ns)); }

// `unit`: what the caller's lambda is of the one that found and direction are in.
void write_hit(uint hit_index, Found found, vec3 origin, vec3 direction, float unit, vec3 v_origin, int t_ns) {
  const int place = int(hit_index * hit_texels);
  const bool hit = found.status == status_hit;
  const Instance i = instance_at(hit ? found.instance : 0u);
  const int corners = int(found.slot * triangle_texels);
  const vec3 a = triangle_texel(corners).xyz;
  const vec3 ab = triangle_texel(corners + 1).xyz - a;
  const vec3 ac = triangle_texel(corners + 2).xyz - a;
  // Normals turn with the body and scale with the inverse. Lengths near one, so that no square vanishes.
  const vec3 n = cross(ab / largest(ab), ac / largest(ac)) / i.scale;
  const vec3 n_world = normalize(rotate(orientation_of(i, t_ns), n / largest(n)));
  const vec3 v_relative_mps = velocity_at(i, t_ns, origin + found.lambda * direction) - v_origin;
  const uvec4 nothing = uvec4(0u);
  const uvec4 side = uvec4(found.triangle, found.front ? 1u : 0u, floatBitsToUint(n_world.xy));
  const uvec4 motion = uvec4(floatBitsToUint(n_world.z), floatBitsToUint(v_relative_mps));
  imageStore(hits, place, hit ? uvec4(found.status, floatBitsToUint(vec3(found.lambda * unit, found.u, found.v)))
                              : uvec4(found.status, nothing.xyz));
  imageStore(hits, place + 1, hit ? texelFetch(identities, int(hit ? found.entity : 0u)) : uvec4(no_entity, nothing.xyz));
  imageStore(hits, place + 2, hit ? side : nothing);
  imageStore(hits, place + 3, hit ? motion : nothing);
}

void main() {
  // Workgroups are handed to lavapipe's threads in contiguous halves; taking rays crosswise gives both the same work.
  const uint group = args.first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x);
  const uint shared_index = group * 64u + gl_LocalInvocationID.x;
#ifdef RAY_PACKET
  // A lane without a ray goes along as the first one, and meets nothing.
  const bool asks = shared_index < args.count;
  const uint index = asks ? shared_index : 0u;
#else
  const bool alone = args.alone != 0u;
  const uint place = args.first + gl_WorkGroupID.x;
  const uint index = alone ? texelFetch(again, int(place >> 2))[place & 3u] : shared_index;
  if ((alone ? gl_LocalInvocationID.x != 0u : index >= args.count)) return;
#endif
  const int base = int(index * ray_texels);
  const vec4 r0 = texelFetch(rays, base);
  const vec4 r1 = texelFetch(rays, base + 1);
  const vec4 r2 = texelFetch(rays, base + 2);
  const uint at_ns = args.still != 0u ? args.still_ns : floatBitsToUint(r2.x);
  const uint since_epoch_ns = at_ns - args.epoch_ns;
  const bool late = since_epoch_ns >= epoch_length_ns;
  const int t_ns = int(late ? since_epoch_ns - epoch_length_ns : since_epoch_ns);
  const uint instance_base = late ? args.late_base : 0u;
  const float share = clamp(float(at_ns - args.window_begin_ns) * args.per_window_ns, 0.0, 1.0);
  vec3 origin = r0.xyz;
  vec3 direction = vec3(r0.w, r1.xy);
  vec3 v_origin = vec3(0.0);
#ifdef RAY_MOVING
#ifdef RAY_PACKET
  const uint carrier = asks ? floatBitsToUint(r2.w) : no_entity;
#else
  const uint carrier = floatBitsToUint(r2.w);
#endif
  if (carrier != no_entity) {
    const Instance i = instance_at(places[carrier] + instance_base);
    const vec4 q = orientation_of(i, t_ns);
    origin = position_of(i, t_ns) + rotate(q, origin);
    direction = rotate(q, direction);
    v_origin = velocity_at(i, t_ns, origin);
  }
#endif
  // By a power of two, which changes no digit: whatever the direction's length, products of the search stay far from the ends of
  // single precision.
  const uint exponent = floatBitsToUint(largest(direction)) >> 23;
  const float unit = uintBitsToFloat(254u - exponent << 23);
  direction *= unit;
  const float lambda_min = r1.z * uintBitsToFloat(exponent << 23);
  const float lambda_max = min(r1.w * uintBitsToFloat(exponent << 23), 3.4e38);
#ifdef RAY_LIST
  clear_list();
#endif
  const Segment world = make_segment(-origin, direction);
  const uint mask = floatBitsToUint(r2.z);
#ifdef RAY_PACKET
  const Found found =
      trace_packet(asks, world, lambda_min, lambda_max, t_ns, share, instance_base, mask, args.root, args.faces, args.two);
  if (!asks) return;
#else
  const Found found = trace(world, lambda_min, lambda_max, t_ns, share, instance_base, mask, args.root, args.faces,
                            args.hits_per_ray - 1u, args.two);
#endif
#if defined(RAY_LIST)
  for (uint k = 0u; k < args.hits_per_ray; ++k) {
    Found one = nothing_within(lambda_max);
    if (found.status == status_incomplete) one.status = status_incomplete;
    if (found.status != status_incomplete && list_entity[k] != no_entity) {
      const Segment ray = enter_instance(make_segment(-origin, direction), instance_at(list_instance[k]), t_ns);
      test_triangle(ray, list_slot[k], lambda_min, args.faces, list_instance[k], list_entity[k], one);
    }
    write_hit(index * args.hits_per_ray + k, one, origin, direction, unit, v_origin, t_ns);
  }
#elif defined(RAY_ANY)
  // The rest of the hit stays as it was made.
  imageStore(hits, int(index * hit_texels), uvec4(found.status, 0u, 0u, 0u));
#else
  write_hit(index, found, origin, direction, unit, v_origin, t_ns);
#endif
  if (found.status == status_incomplete) some_incomplete = 1u;
}
