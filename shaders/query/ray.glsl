// The body of both ray queries: reads a ray, traces it, writes the hit. See rtstdb/query.hpp for what the fields mean.
#include "common/interleave.glsl"
#include "query/traverse.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RayArgs args; };
layout(set = 0, binding = 3) uniform samplerBuffer rays;
layout(set = 0, binding = 4, scalar) writeonly buffer HitsBuffer { HitRecord hits[]; };

float largest(vec3 p) { return max(max(abs(p.x), abs(p.y)), abs(p.z)); }

vec3 velocity_at(Instance i, float t_s, vec3 point) { return i.v + cross(i.w, point - (i.p + i.v * t_s)); }

void main() {
  // Workgroups are handed to lavapipe's threads in contiguous halves; taking rays crosswise gives both the same work.
  const uint shared_index = interleaved(gl_WorkGroupID.x, gl_NumWorkGroups.x) * 64u + gl_LocalInvocationID.x;
  const bool alone = args.alone != 0u;
  const uint index = alone ? gl_WorkGroupID.x : shared_index;
  if (index >= args.count || (alone && gl_LocalInvocationID.x != 0u)) return;
  const vec4 r0 = texelFetch(rays, int(3u * index));
  const vec4 r1 = texelFetch(rays, int(3u * index + 1u));
  const vec4 r2 = texelFetch(rays, int(3u * index + 2u));
  const float t_s = r2.x;
  const uint mask = floatBitsToUint(r2.y);
  const uint carrier = floatBitsToUint(r2.z);
  const uint instance_base = floatBitsToUint(r2.w);
  vec3 origin = r0.xyz;
  vec3 direction = r1.xyz;
  vec3 v_origin = vec3(0.0);
  if (carrier != no_entity) {
    const Instance i = fetch_instance(instances, carrier + instance_base);
    const vec4 q = orientation_at(i.q, i.w, t_s);
    origin = i.p + i.v * t_s + rotate(q, r0.xyz);
    direction = rotate(q, r1.xyz);
    v_origin = velocity_at(i, t_s, origin);
  }
  const Found found = trace(make_segment(origin, direction), r0.w, r1.w, t_s, instance_base, mask, args.root, args.two);
  HitRecord hit;
  hit.status = found.status;
  hit.lambda = hit.u = hit.v = 0.0;
  hit.entity = no_entity;
  hit.triangle = 0u;
  hit.front_face = 0u;
  hit.n_world = hit.v_relative_mps = vec3(0.0);
#ifndef RAY_ANY
  if (found.status == status_hit) {
    const Instance i = fetch_instance(instances, found.instance);
    const int base = int(found.slot * triangle_texels);
    const vec3 a = texelFetch(triangles, base).xyz;
    const vec3 ab = texelFetch(triangles, base + 1).xyz - a;
    const vec3 ac = texelFetch(triangles, base + 2).xyz - a;
    hit.lambda = found.lambda;
    hit.u = found.u;
    hit.v = found.v;
    hit.entity = found.entity;
    hit.triangle = found.triangle;
    hit.front_face = found.front ? 1u : 0u;
    // Normals turn with the body and scale with the inverse. Lengths near one, so that no square vanishes.
    const vec3 n = cross(ab / largest(ab), ac / largest(ac)) / i.scale;
    hit.n_world = normalize(rotate(orientation_at(i.q, i.w, t_s), n / largest(n)));
    hit.v_relative_mps = velocity_at(i, t_s, origin + found.lambda * direction) - v_origin;
  }
#endif
  hits[index] = hit;
}
