// A cone in the world at its instant, in the frame of an instance, and against boxes and triangles there.
//
// Included after the bindings `instances`, `triangles` and the arguments `args` are declared.
#ifndef RTSTDB_QUERY_CONE_CONE_GLSL
#define RTSTDB_QUERY_CONE_CONE_GLSL
#include "common/instance.glsl"
#include "common/wide_node.glsl"
#include "query/cone/contact.glsl"
#include "query/ray/traced_ray.glsl"
#include "shared/cone.h"

// By how much boxes are enlarged for rounding, as parts of the largest distance along an axis: a box of a
// tree by more than the triangles' boxes in it, and by at least as much as for a ray (blur_of). So no answer
// depends on the order in which boxes are visited.
const float triangle_blur = 2e-6;
const float geometry_blur = 4e-6;
const float world_blur = 8e-6;

// What the tests of boxes need of a cone. The points of the cone with z = 1 have a largest and a least
// coordinate along each axis of the frame; per_max and per_min are the inverses of these.
struct ConeSlopes {
  vec3 axis;
  vec3 per_max;
  vec3 per_min;
};

ConeSlopes slopes_of(vec3 axis, float tangent) {
  const vec3 across =
      tangent * sqrt(vec3(dot(axis.yz, axis.yz), dot(axis.xz, axis.xz), dot(axis.xy, axis.xy)));
  // Also covers the rounding of the inverses.
  const vec3 margin = 2e-6 * (abs(axis) + across);
  return ConeSlopes(axis, inverse_direction(axis + across + margin),
                    inverse_direction(axis - across - margin));
}

// A lower bound of the axial coordinate of the points that a box and the part of the cone from `from` on have
// in common; `nowhere`: there are none. The corners are relative to the apex. The bound of a box is not below
// that of a box that contains it.
float box_bound_from(ConeSlopes cone, vec3 lo, vec3 hi, float from) {
  precise vec3 from_lo = lo * cone.per_max;
  precise vec3 from_hi = hi * cone.per_min;
  const bvec3 above = greaterThan(cone.per_max, vec3(0.0));
  const bvec3 below = lessThan(cone.per_min, vec3(0.0));
  const vec3 enters = max(mix(vec3(-nowhere), from_lo, above), mix(vec3(-nowhere), from_hi, below));
  const vec3 leaves = min(mix(from_lo, vec3(nowhere), above), mix(from_hi, vec3(nowhere), below));
  precise vec3 at_lo = cone.axis * lo;
  precise vec3 at_hi = cone.axis * hi;
  const vec3 min_along = min(at_lo, at_hi);
  const vec3 max_along = max(at_lo, at_hi);
  precise float first = min_along.x + min_along.y + min_along.z;
  precise float last = max_along.x + max_along.y + max_along.z;
  const float enter = max(max(enters.x, max(enters.y, enters.z)), max(first, from));
  const float leave = min(min(leaves.x, min(leaves.y, leaves.z)), last);
  return enter <= leave ? enter : nowhere;
}

float box_bound(ConeSlopes cone, vec3 lo, vec3 hi) { return box_bound_from(cone, lo, hi, 0.0); }

// A cone in the world.
struct TracedCone {
  TracedRay axis;
  float m_per_lambda;  // length of the axis' direction
  mat3 basis;          // two directions across the axis, and the axis
  HalfAngle angle;
  ConeSlopes slopes;
};

bool is_ray(HalfAngle angle) { return angle.sine == 0.0; }

// An orthonormal basis whose third vector is the axis (Duff et al. 2017, "Building an Orthonormal Basis,
// Revisited").
mat3 basis_of(vec3 axis) {
  const float side = axis.z < 0.0 ? -1.0 : 1.0;
  const float a = -1.0 / (side + axis.z);
  const float b = axis.x * axis.y * a;
  return mat3(vec3(1.0 + side * axis.x * axis.x * a, side * b, -side * axis.x),
              vec3(b, side + axis.y * axis.y * a, -axis.y), axis);
}

TracedCone traced_cone(ConeRecord record) {
  TracedCone cone;
  cone.axis.origin = record.apex_m;
  cone.axis.direction = record.direction;
  cone.axis.v_origin = vec3(0.0);
  cone.axis.lambda_min = 0.0;
  cone.axis.lambda_max = record.lambda_max;
  cone.axis.mask = record.mask;
  cone.axis.t_ns = record.t_ns;
  cone.axis.instance_base = record.instance_base;
  cone.axis.share = record.share;
  if (record.carrier != no_entity)
    carry(fetch_instance(instances, record.carrier + record.instance_base), cone.axis);
  scale_direction(cone.axis);
  cone.m_per_lambda = length(cone.axis.direction);
  cone.basis = basis_of(cone.axis.direction / cone.m_per_lambda);
  cone.angle = HalfAngle(record.sine, record.cosine, record.tangent);
  cone.slopes = slopes_of(cone.basis[2], record.tangent);
  return cone;
}

// The bound of a child of a TLAS's node. `wide`: its origin is relative to the apex.
float entity_child_bound(ConeSlopes slopes, MotionNode wide, uint k) {
  const float blur = world_blur * largest(abs(wide.begin.origin) + 255.0 * wide.begin.quantum);
  precise vec3 lo = child_lo(wide, k) - blur;
  precise vec3 hi = child_hi(wide, k) + blur;
  return box_bound(slopes, lo, hi);
}

// A cone in the frame of an instance, which is rotated but not scaled, so that the cone stays round. Corners
// of the geometry are made relative to the apex before they are scaled: so rounding is proportional to their
// distance from the apex.
struct ConeInFrame {
  Segment axis;  // in the frame of the geometry
  mat3 to_cone;  // from this frame to the cone's coordinates
  vec3 scale;
  float from;       // metres along the axis: boxes before it are skipped
  vec3 farthest_m;  // by axis, at least the largest distance of the geometry along any axis
  ConeSlopes slopes;
};

ConeInFrame enter_instance(TracedCone cone, Instance i, uvec4 root) {
  const vec4 q = conjugate(orientation_of(i, cone.axis.t_ns));
  ConeInFrame there;
  there.axis = enter_instance(make_segment(-cone.axis.origin, cone.axis.direction), i, cone.axis.t_ns, root);
  const vec3 axis = rotate(q, cone.basis[2]);
  there.to_cone = transpose(mat3(rotate(q, cone.basis[0]), rotate(q, cone.basis[1]), axis));
  there.scale = i.scale;
  there.from = 0.0;
  const vec3 extent = abs(uintBitsToFloat(root.xyz) + there.axis.minus_o) + 255.0 * quantum_of(root);
  there.farthest_m = max(vec3(largest(extent * i.scale)), largest(extent) * i.scale);
  there.slopes = slopes_of(axis, cone.angle.tangent);
  return there;
}

// The bound of a child of a geometry's node. `wide`: its origin is relative to the apex.
float geometry_child_bound(ConeInFrame there, WideNode wide, uint k) {
  const vec3 blur = geometry_blur * there.farthest_m;
  precise vec3 lo = child_lo(wide, k) * there.scale - blur;
  precise vec3 hi = child_hi(wide, k) * there.scale + blur;
  return box_bound_from(there.slopes, lo, hi, there.from);
}

WideNode fetch_geometry_node(usamplerBuffer nodes, uint node, ConeInFrame there) {
  WideNode wide = fetch_wide_node(nodes, node);
  wide.origin += there.axis.minus_o;
  return wide;
}

MotionNode fetch_entity_node(usamplerBuffer tlas, uint node, TracedCone cone) {
  MotionNode wide = fetch_motion_node(tlas, node, cone.axis.share);
  wide.begin.origin -= cone.axis.origin;
  return wide;
}

// The corners of a triangle of the geometry, in its frame.
struct Corners {
  vec3 a, b, c;
  uint triangle;
  bool has_area;
};

Corners fetch_corners(uint slot) {
  const int base = int(slot * triangle_texels);
  const vec4 t0 = texelFetch(triangles, base);
  const vec4 t1 = texelFetch(triangles, base + 1);
  return Corners(t0.xyz, t1.xyz, texelFetch(triangles, base + 2).xyz, floatBitsToUint(t0.w),
                 floatBitsToUint(t1.w) != triangle_without_area);
}

// A point of the geometry in the cone's coordinates.
vec3 in_cone(ConeInFrame there, vec3 corner) {
  precise vec3 from_apex = (corner + there.axis.minus_o) * there.scale;
  return there.to_cone * from_apex;
}

// The difference of two points of the geometry in the cone's coordinates.
vec3 step_in_cone(ConeInFrame there, vec3 from, vec3 to) {
  precise vec3 step = (to - from) * there.scale;
  return there.to_cone * step;
}

// The bound of a triangle's own box.
float triangle_bound(ConeInFrame there, vec3 corner_a, vec3 corner_b, vec3 corner_c) {
  const vec3 blur = triangle_blur * there.farthest_m;
  const vec3 a = (corner_a + there.axis.minus_o) * there.scale;
  const vec3 b = (corner_b + there.axis.minus_o) * there.scale;
  const vec3 c = (corner_c + there.axis.minus_o) * there.scale;
  return box_bound(there.slopes, min(a, min(b, c)) - blur, max(a, max(b, c)) + blur);
}

// The first contact with a triangle. `lambda` is that of the scaled direction.
struct TriangleContact {
  bool found;
  float lambda;
  float u;
  float v;
  bool front;
};

// The point where a ray along the axis hits the triangle is a contact of every cone, so no cone passes
// between triangles that share an edge. For a cone with the opening angle 0 it is the only contact.
TriangleContact contact_with(ConeInFrame there, TracedCone cone, uint slot) {
  const bool without_opening = is_ray(cone.angle);
  Found hit = nothing_within(cone.axis.lambda_max);
  const int base = int(slot * triangle_texels);
  test_corners(there.axis, texelFetch(triangles, base), texelFetch(triangles, base + 1),
               texelFetch(triangles, base + 2).xyz, slot, 0.0, without_opening ? args.faces : 0.0, 0u, 0u,
               hit);
  const bool hits = hit.status == status_hit;
  TriangleContact contact = TriangleContact(hits, hit.lambda, hit.u, hit.v, hit.front);
  const Corners corners = fetch_corners(slot);
  float facing;
  Contact first = first_contact(in_cone(there, corners.a), step_in_cone(there, corners.a, corners.b),
                                step_in_cone(there, corners.a, corners.c), cone.angle, facing);
  offer_contact(first, hits, hit.lambda * cone.m_per_lambda, hit.u, hit.v);
  // Rounding must not put the contact before the bound of the triangle's own box.
  const float bound = triangle_bound(there, corners.a, corners.b, corners.c);
  const float lambda = max(first.z, bound) / cone.m_per_lambda;
  const bool meets = first.z < nowhere && bound < nowhere && lambda <= cone.axis.lambda_max &&
                     corners.has_area && facing * args.faces >= 0.0;
  contact.found = without_opening ? contact.found : meets;
  contact.lambda = without_opening ? contact.lambda : lambda;
  contact.u = without_opening ? contact.u : first.u;
  contact.v = without_opening ? contact.v : first.v;
  contact.front = without_opening ? contact.front : facing > 0.0;
  return contact;
}

#endif
