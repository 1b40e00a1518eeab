// The body of the ray queries: reads a ray, traces it, writes the hit. See rtstdb/query.hpp for what the fields mean.
//
// Include with RAY_ANY defined for rays that stop at the first hit, RAY_MOVING where they ask at different instants or
// some of them move with an entity, RAY_LIST as the largest number of hits of each, where that is more than one, RAY_PACKET
// where eight neighbours run side by side.
#include "common/exact_cross.glsl"
#include "common/pairs.glsl"
#include "common/places.glsl"
#ifdef RAY_PACKET
#include "query/packet.glsl"
#else
#include "query/traverse.glsl"
#endif

#ifdef RAY_PACKET
// One subgroup, which goes through its group's rays eight at a time.
layout(local_size_x = 8) in;
#else
layout(local_size_x = 64) in;
#endif
layout(push_constant, scalar) uniform Push { RayArgs args; };
layout(set = 0, binding = 4) uniform usamplerBuffer identities;
layout(set = 0, binding = 5) uniform samplerBuffer rays;
layout(set = 0, binding = 6) uniform usamplerBuffer again;
layout(set = 0, binding = 7, scalar) writeonly buffer IncompleteBuffer { uint some_incomplete; };
#ifdef RAY_MOVING
layout(set = 0, binding = 8, scalar) readonly buffer PlacesBuffer { uint places[]; };
#endif

Destination destination_of_hit(uint place) { return destination_of(args.hits, place, 8u * hit_pairs); }

float largest(vec3 p) { return max(max(abs(p.x), abs(p.y)), abs(p.z)); }

vec3 velocity_at(Instance i, int t_ns, vec3 point) { return i.v + cross(i.w, point - position_of(i, t_ns)); }

// A ray as it is traced, in the world's frame. `unit`: what the caller's lambda is of this one's.
struct Asked {
  vec3 origin;
  vec3 direction;
  float unit;
  vec3 v_origin;
  float lambda_min;
  float lambda_max;
  uint mask;
  int t_ns;
  uint instance_base;
  float share;  // of the window that has passed
};

Asked read_ray(uint index) {
  const int base = int(index * ray_texels);
  const vec4 r0 = texelFetch(rays, base);
  const vec4 r1 = texelFetch(rays, base + 1);
  const vec4 r2 = texelFetch(rays, base + 2);
  const uint at_ns = args.still != 0u ? args.still_ns : floatBitsToUint(r2.x);
  const uint since_epoch_ns = at_ns - args.epoch_ns;
  const bool late = since_epoch_ns >= epoch_length_ns;
  Asked asked;
  asked.t_ns = int(late ? since_epoch_ns - epoch_length_ns : since_epoch_ns);
  asked.instance_base = late ? args.late_base : 0u;
  asked.share = clamp(float(at_ns - args.window_begin_ns) * args.per_window_ns, 0.0, 1.0);
  asked.origin = r0.xyz;
  asked.direction = vec3(r0.w, r1.xy);
  asked.v_origin = vec3(0.0);
#ifdef RAY_MOVING
  const uint carrier = floatBitsToUint(r2.w);
  if (carrier != no_entity) {
    const Instance i = instance_at(places[carrier] + asked.instance_base);
    const vec4 q = orientation_of(i, asked.t_ns);
    asked.origin = position_of(i, asked.t_ns) + rotate(q, asked.origin);
    asked.direction = rotate(q, asked.direction);
    asked.v_origin = velocity_at(i, asked.t_ns, asked.origin);
  }
#endif
  // By a power of two, which changes no digit: whatever the direction's length, products of the search stay far from the ends of
  // single precision.
  const uint exponent = floatBitsToUint(largest(asked.direction)) >> 23;
  asked.unit = uintBitsToFloat(254u - exponent << 23);
  asked.direction *= asked.unit;
  asked.lambda_min = r1.z * uintBitsToFloat(exponent << 23);
  asked.lambda_max = min(r1.w * uintBitsToFloat(exponent << 23), 3.4e38);
  asked.mask = floatBitsToUint(r2.z);
  return asked;
}

void write_hit(uint place, Found found, Asked ray) {
  const bool hit = found.status == status_hit;
  const Instance i = instance_at(hit ? found.instance : 0u);
  const int corners = int(found.slot * triangle_texels);
  const vec3 across =
      direction_across(triangle_texel(corners).xyz, triangle_texel(corners + 1).xyz, triangle_texel(corners + 2).xyz);
  // Normals turn with the body and scale with the inverse. Lengths near one, so that no square vanishes.
  const vec3 n = across / largest(across) / i.scale;
  const vec3 n_world = normalize(rotate(orientation_of(i, ray.t_ns), n / largest(n)));
  const vec3 v_relative_mps = velocity_at(i, ray.t_ns, ray.origin + found.lambda * ray.direction) - ray.v_origin;
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

#ifdef RAY_PACKET
// Whether two rays gain by going together: directions within 0.1 rad, origins within a decimetre.
bool runs_beside(vec3 apart, vec3 a, vec3 b) {
  const float along = dot(a, b);
  return largest(apart) <= 0.1 && along > 0.0 && along * along >= 0.99 * dot(a, a) * dot(b, b);
}

// Rays that part from the first one go in a turn of their own, with those beside them. Where an image's row ends, a packet has rays of
// the next one, too: a beam around both would be led through the whole world.
Found trace_together(bool asks, Asked ray, Entries entries, inout uint rounds, uint allowed) {
  Found found = nothing_within(0.0);
  found.status = status_incomplete;
  const Segment world = make_segment(-ray.origin, ray.direction);
  bool left = asks;
  do {
    const uint first_lane = least_of_lanes(left ? gl_SubgroupInvocationID : 0xFFu) & 7u;
    const vec3 apart = ray.origin - of_lane(ray.origin, first_lane);
    const bool mine = left && runs_beside(apart, ray.direction, of_lane(ray.direction, first_lane));
    const Found now = trace_packet(mine, first_lane, world, ray.lambda_min, ray.lambda_max, ray.t_ns, ray.share, ray.instance_base,
                                   ray.mask, args.root, args.faces, args.two, entries, rounds, allowed);
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
  const Asked lead = read_ray(first);
  Bounds bounds = Bounds(lead.direction, lead.direction, -lead.origin, -lead.origin, lead.lambda_min, lead.lambda_max);
  uint turn = 0u;
  do {
    const uint index = first + 8u * turn + gl_SubgroupInvocationID;
    const Asked ray = read_ray(index < args.end ? index : first);
    take_in(bounds, ray.direction, -ray.origin, ray.lambda_min, ray.lambda_max);
    ++turn;
  } while (turn < turns);
  rounds += turns;
  return find_entries(of_all_lanes(bounds), lead.direction, lead.t_ns, lead.instance_base, args.root, rounds);
}
#endif

void main() {
  const uint first = args.first + interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * args.per_group;
  const uint turns = max(args.per_group / 8u, 1u);
  uint rounds = turns;
  const Entries entries = entries_of(first, turns, rounds);
  uint turn = 0u;
  do {
    const uint index = first + 8u * turn + gl_SubgroupInvocationID;
    const bool asks = index < args.end;
    // A lane without a ray has one that there is, and asks nothing.
    const Asked ray = read_ray(asks ? index : first);
    ++turn;
    // What one packet leaves of what it may have is there for those behind it.
    const Found found = trace_together(asks, ray, entries, rounds, max_rounds / turns * turn);
    if (asks) {
#ifdef RAY_ANY
      // The rest of the hit stays as it was made.
      store_pair(destination_of_hit(index), 0u, uvec2(found.status, 0u));
#else
      write_hit(index, found, ray);
#endif
      if (found.status == status_incomplete) some_incomplete = 1u;
    }
  } while (turn < turns);
}
#else
void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  // Who has no place runs along for the others of its subgroup, with a ray that there is.
  const bool asks = place < args.end;
  const uint known = asks ? place : args.first;
  const uint index = args.asked_again != 0u ? texelFetch(again, int(known >> 2))[known & 3u] : known;
  const Asked ray = read_ray(index);
#ifdef RAY_LIST
  clear_list();
#endif
  const Found found = trace(make_segment(-ray.origin, ray.direction), ray.lambda_min, ray.lambda_max, ray.t_ns, ray.share,
                            ray.instance_base, ray.mask, asks ? args.root : ref_none, args.faces, args.hits_per_ray - 1u, args.two);
  if (!asks) return;
#if defined(RAY_LIST)
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
#elif defined(RAY_ANY)
  // The rest of the hit stays as it was made.
  store_pair(destination_of_hit(index), 0u, uvec2(found.status, 0u));
#else
  write_hit(index, found, ray);
#endif
  if (found.status == status_incomplete) some_incomplete = 1u;
}
#endif
