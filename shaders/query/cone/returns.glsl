// How cone.comp and cone_fractions.comp write a return. rtstdb/query.hpp defines the fields.
//
// Included after cone.glsl and the bindings `identities` and `nodes`.
#ifndef RTSTDB_QUERY_CONE_RETURNS_GLSL
#define RTSTDB_QUERY_CONE_RETURNS_GLSL
#include "common/pairs.glsl"

uvec4 head_of(uint node) { return texelFetch(nodes, int(node * node_texels)); }

// A contact with all data that a return and the fractions of a beam need.
struct FullContact {
  Instance instance;
  TriangleContact at;
  Corners corners;
  vec3 point;  // in the cone's coordinates
  bool by_field;
};

// `contact`: what the search found.
FullContact full_contact(TracedCone cone, ConeContact contact) {
  FullContact full;
  full.instance = fetch_instance(instances, contact.instance);
  const ConeInFrame there = enter_instance(cone, full.instance, head_of(full.instance.blas_root));
  const uint slot = contact.slot & ~contact_by_field_bit;
  full.by_field = slot != contact.slot;
  full.at = contact_with(there, cone, slot);
  full.at.lambda = contact.lambda;
  full.corners = fetch_corners(slot);
  full.point = in_cone(there, full.corners.a) +
               full.at.u * step_in_cone(there, full.corners.a, full.corners.b) +
               full.at.v * step_in_cone(there, full.corners.a, full.corners.c);
  return full;
}

Destination destination_of_return(uint place) {
  return destination_of(args.returns, place, 8u * return_pairs);
}

void write_return(uint place, TracedCone cone, FullContact contact, float fraction, bool overflow) {
  const Instance i = contact.instance;
  const int t_ns = cone.axis.t_ns;
  const vec3 n_world = world_normal(i, t_ns, contact.corners.a, contact.corners.b, contact.corners.c);
  const vec3 on_axis = cone.axis.origin + contact.at.lambda * cone.axis.direction;
  const vec3 beside_axis = cone.axis.origin + cone.basis * contact.point;
  const vec3 v_relative_mps =
      velocity_at(i, t_ns, is_ray(cone.angle) ? on_axis : beside_axis) - cone.axis.v_origin;
  const uvec4 identity = texelFetch(identities, int(i.entity));
  const Destination to = destination_of_return(place);
  store_pair(to, 0u, uvec2(status_hit, floatBitsToUint(contact.at.lambda * cone.axis.unit)));
  store_pair(to, 1u, floatBitsToUint(vec2(contact.at.u, contact.at.v)));
  store_pair(to, 2u, identity.xy);
  store_pair(to, 3u, identity.zw);
  store_pair(
      to, 4u,
      uvec2(contact.corners.triangle, (contact.at.front ? 1u : 0u) | (overflow ? return_overflow_bit : 0u) |
                                          (contact.by_field ? return_by_field_bit : 0u)));
  store_pair(to, 5u, floatBitsToUint(n_world.xy));
  store_pair(to, 6u, floatBitsToUint(vec2(n_world.z, v_relative_mps.x)));
  store_pair(to, 7u, floatBitsToUint(v_relative_mps.yz));
  store_pair(to, 8u, uvec2(floatBitsToUint(fraction), 0u));
}

void write_no_return(uint place, uint status, bool overflow) {
  const Destination to = destination_of_return(place);
  store_pair(to, 0u, uvec2(status, 0u));
  store_pair(to, 1u, uvec2(0u));
  store_pair(to, 2u, uvec2(no_entity, 0u));
  store_pair(to, 3u, uvec2(0u));
  store_pair(to, 4u, uvec2(0u, overflow ? return_overflow_bit : 0u));
  [[unroll]] for (uint pair = 5u; pair < return_pairs; ++pair) store_pair(to, pair, uvec2(0u));
}

#endif
