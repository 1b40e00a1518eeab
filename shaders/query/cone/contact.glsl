// The first contact of a triangle with a cone: the point of both with the least axial coordinate.
//
// Coordinates: x and y across the axis, z along it, from the apex, in metres. A point is in the cone if
// |(x, y)| cosine <= z sine, with z >= 0, where sine and cosine are those of half the opening angle. Triangle
// and cone are convex, so the point with the least z is a corner in the cone, a point where an edge crosses
// the cone's surface, or the first point of the cone in the triangle's plane. The last one lies on a
// generator, a line of the cone's surface through the apex; it is the apex if that lies in the triangle.
#ifndef RTSTDB_QUERY_CONE_CONTACT_GLSL
#define RTSTDB_QUERY_CONE_CONTACT_GLSL
#include "query/ray/ray_triangle.glsl"

const float nowhere = 3.4e38;  // farther than anything

struct HalfAngle {
  float sine;
  float cosine;
  float tangent;
};

struct Contact {
  float z;  // nowhere: none
  float u;
  float v;
};

void offer_contact(inout Contact best, bool valid, float z, float u, float v) {
  const bool nearer = valid && z < best.z;
  best.z = nearer ? z : best.z;
  best.u = nearer ? u : best.u;
  best.v = nearer ? v : best.v;
}

bool is_in_cone(vec3 p, HalfAngle angle) {
  return p.z >= 0.0 && angle.cosine * length(p.xy) <= angle.sine * p.z;
}

// Where the line a + t d crosses the double cone, which is the cone and its mirror image behind the apex: at
// the roots of A t^2 + 2 B t + C = 0.
struct EdgeCrossing {
  float square;  // A: above zero if both ends of the line are outside the double cone
  vec2 roots;    // -1 for a root at infinity
  bool crosses;
};

// The discriminant is computed by Lagrange's identity as a difference of two lengths, which does not cancel
// for thin cones.
EdgeCrossing edge_crossing(vec3 a, vec3 d, HalfAngle angle) {
  const vec3 m = cross(a, d);
  const float across = angle.sine * length(m.xy);
  const float along = angle.cosine * abs(m.z);
  const float root = angle.cosine * sqrt(max((across - along) * (across + along), 0.0));
  const float d_across = angle.cosine * length(d.xy);
  const float d_along = angle.sine * abs(d.z);
  const float a_across = angle.cosine * length(a.xy);
  const float a_along = angle.sine * abs(a.z);
  const float square = (d_across - d_along) * (d_across + d_along);
  const float constant = (a_across - a_along) * (a_across + a_along);
  const float linear = angle.cosine * angle.cosine * dot(a.xy, d.xy) - angle.sine * angle.sine * a.z * d.z;
  // The stable form of both roots.
  const float w = -(linear + (linear < 0.0 ? -root : root));
  return EdgeCrossing(square, vec2(square == 0.0 ? -1.0 : w / square, w == 0.0 ? -1.0 : constant / w),
                      across >= along);
}

// `uv`, `uv_step`: the weights at a + t d are uv + t uv_step.
void offer_edge(vec3 a, vec3 d, vec2 uv, vec2 uv_step, HalfAngle angle, inout Contact best) {
  const EdgeCrossing crossing = edge_crossing(a, d, angle);
  [[unroll]] for (uint k = 0u; k < 2u; ++k) {
    const float t = crossing.roots[k];
    const float z = a.z + t * d.z;
    const vec2 at = uv + t * uv_step;
    offer_contact(best, crossing.crosses && t >= 0.0 && t <= 1.0 && z >= 0.0, z, at.x, at.y);
  }
}

// The generator that meets the triangle's plane first is the one that is inclined towards the plane. `n`: the
// plane's normal, away from the apex.
void offer_generator(vec3 a, vec3 b, vec3 c, vec3 n, HalfAngle angle, inout Contact best) {
  const float lean = length(n.xy);
  const vec2 towards = lean > 0.0 ? angle.sine * n.xy / lean : vec2(0.0);
  // Sheared so that the generator becomes the z axis (test_corners).
  const float upright = lean > 0.0 ? angle.cosine : 1.0;
  precise vec2 a2 = upright * a.xy - towards * a.z;
  precise vec2 b2 = upright * b.xy - towards * b.z;
  precise vec2 c2 = upright * c.xy - towards * c.z;
  const float wa = edge_function(c2, b2);
  const float wb = edge_function(a2, c2);
  const float wc = edge_function(b2, a2);
  const bool inside =
      ((wa >= 0.0 && wb >= 0.0 && wc >= 0.0) || (wa <= 0.0 && wb <= 0.0 && wc <= 0.0)) && !beside(a2, b2, c2);
  const float sum = wa + wb + wc;
  const float share = 1.0 / (sum == 0.0 ? 1.0 : sum);
  const float z =
      clamp((wa * a.z + wb * b.z + wc * c.z) * share, min(a.z, min(b.z, c.z)), max(a.z, max(b.z, c.z)));
  offer_contact(best, inside && sum != 0.0 && z >= 0.0, z, wb * share, wc * share);
}

// The triangle of a, a + ab and a + ac. `facing`: above zero where the apex lies in front of the triangle,
// zero where it lies in its plane.
Contact first_contact(vec3 a, vec3 ab, vec3 ac, HalfAngle angle, out float facing) {
  // Scaled by a power of two, which is exact, so that no product overflows or underflows.
  const vec3 size = max(abs(a), max(abs(ab), abs(ac)));
  const uint exponent = clamp(floatBitsToUint(max(size.x, max(size.y, size.z))) >> 23, 1u, 253u);
  const float unit = uintBitsToFloat(254u - exponent << 23);
  a *= unit;
  ab *= unit;
  ac *= unit;
  const vec3 b = a + ab;
  const vec3 c = a + ac;
  const vec3 n = cross(ab, ac);
  const float offset = dot(n, a);
  facing = -offset;
  Contact best = Contact(nowhere, 0.0, 0.0);
  offer_contact(best, is_in_cone(a, angle), a.z, 0.0, 0.0);
  offer_contact(best, is_in_cone(b, angle), b.z, 1.0, 0.0);
  offer_contact(best, is_in_cone(c, angle), c.z, 0.0, 1.0);
  offer_edge(a, ab, vec2(0.0), vec2(1.0, 0.0), angle, best);
  offer_edge(a, ac, vec2(0.0), vec2(0.0, 1.0), angle, best);
  offer_edge(b, ac - ab, vec2(1.0, 0.0), vec2(-1.0, 1.0), angle, best);
  offer_generator(a, b, c, offset < 0.0 ? -n : n, angle, best);
  best.z = best.z < nowhere ? best.z * uintBitsToFloat(exponent << 23) : nowhere;
  return best;
}

#endif
