// The part of a beam's cross-section that a triangle covers: the area of its central projection within the
// beam, in units in which the beam's radius is one. Exact up to rounding: the border of the projection is
// followed edge by edge; where it runs outside the beam, the beam's border takes its place.
//
// Coordinates as in contact.glsl.
#ifndef RTSTDB_QUERY_CONE_COVERED_AREA_GLSL
#define RTSTDB_QUERY_CONE_COVERED_AREA_GLSL
#include "query/cone/contact.glsl"

float cross_2d(vec2 p, vec2 q) { return p.x * q.y - p.y * q.x; }

// Twice the area of the beam's sector between two directions.
float sector(vec2 p, vec2 q) {
  const float y = cross_2d(p, q);
  const float x = dot(p, q);
  return x == 0.0 && y == 0.0 ? 0.0 : atan(y, x);
}

// The part of a + t d, first <= t <= last, that is in the cone; empty: the second value is below the first.
// The line is in the cone between its two crossings, or on one side of its only crossing.
vec2 stretch_in_cone(vec3 a, vec3 d, HalfAngle angle, float first, float last) {
  const EdgeCrossing crossing = edge_crossing(a, d, angle);
  const float low = min(crossing.roots.x, crossing.roots.y);
  const float high = max(crossing.roots.x, crossing.roots.y);
  const vec2 z = a.z + crossing.roots * d.z;
  const float one = z.x > z.y ? crossing.roots.x : crossing.roots.y;
  const bool between = crossing.square > 0.0;
  const bool none = between && (!crossing.crosses || min(z.x, z.y) < 0.0);
  const vec2 stretch = between ? vec2(low, high) : d.z > 0.0 ? vec2(one, nowhere) : vec2(-nowhere, one);
  return none ? vec2(1.0, 0.0) : vec2(max(first, stretch.x), min(last, stretch.y));
}

vec2 projected(vec3 p, HalfAngle angle) { return p.xy / max(angle.tangent * p.z, 1e-37); }

// Whether the middle of a stretch is in the cone, up to rounding. Crossings of a line that is parallel to a
// generator are rounding alone.
bool is_real(vec2 stretch, vec3 a, vec3 d, HalfAngle angle) {
  const vec3 middle = a + 0.5 * (stretch.x + stretch.y) * d;
  const vec3 size = max(abs(a), abs(a + d));
  const float rounding = 1e-6 * max(size.x, max(size.y, size.z));
  return angle.cosine * length(middle.xy) <= angle.sine * middle.z + rounding;
}

// Twice the signed area of the beam between the axis and the part first <= t <= last of the edge a + t d.
float area_beside_edge(vec3 a, vec3 d, HalfAngle angle, float first, float last) {
  const vec2 begin = a.xy + first * d.xy;
  const vec2 end = a.xy + last * d.xy;
  const vec2 inside = stretch_in_cone(a, d, angle, first, last);
  const vec3 enter = a + inside.x * d;
  const vec3 leave = a + inside.y * d;
  const float with_inside = sector(begin, enter.xy) +
                            cross_2d(projected(enter, angle), projected(leave, angle)) +
                            sector(leave.xy, end);
  return inside.x < inside.y && is_real(inside, a, d, angle) ? with_inside : sector(begin, end);
}

// The border of a triangle, clipped to 0 < z <= z_max: first along the edges, then along the planes z = 0 and
// z = z_max. A point in the plane z = 0 is projected to infinity in its direction.
struct Border {
  float twice_area;
  vec2 leaves_near, enters_near;
  vec3 leaves_far, enters_far;
  bool crosses_near, crosses_far;
};

void follow_edge(vec3 a, vec3 d, HalfAngle angle, float z_max, inout Border border) {
  const float z_end = a.z + d.z;
  const bool near = a.z > 0.0 != z_end > 0.0;
  const bool far = a.z <= z_max != z_end <= z_max;
  const float to_near = near ? -a.z / d.z : 0.0;
  const float to_far = far ? (z_max - a.z) / d.z : 0.0;
  float first = 0.0;
  float last = 1.0;
  first = near && a.z <= 0.0 ? max(first, to_near) : first;
  last = near && a.z > 0.0 ? min(last, to_near) : last;
  first = far && a.z > z_max ? max(first, to_far) : first;
  last = far && a.z <= z_max ? min(last, to_far) : last;
  const bool outside = (a.z <= 0.0 && z_end <= 0.0) || (a.z > z_max && z_end > z_max);
  border.twice_area += outside ? 0.0 : area_beside_edge(a, d, angle, first, last);
  const vec2 at_near = a.xy + to_near * d.xy;
  const vec3 at_far = vec3(a.xy + to_far * d.xy, z_max);
  border.crosses_near = border.crosses_near || near;
  border.crosses_far = border.crosses_far || far;
  border.leaves_near = near && a.z > 0.0 ? at_near : border.leaves_near;
  border.enters_near = near && a.z <= 0.0 ? at_near : border.enters_near;
  border.leaves_far = far && a.z <= z_max ? at_far : border.leaves_far;
  border.enters_far = far && a.z > z_max ? at_far : border.enters_far;
}

// Twice the area of a triangle that lies in the cone, from its edges, which are precise even where its
// distance is not.
float twice_area_inside(vec3 a, vec3 ab, vec3 ac, HalfAngle angle) {
  const vec2 slope = a.xy / max(a.z, 1e-37);
  const vec2 p = (ab.xy - slope * ab.z) / max(a.z + ab.z, 1e-37);
  const vec2 q = (ac.xy - slope * ac.z) / max(a.z + ac.z, 1e-37);
  return abs(cross_2d(p, q)) / (angle.tangent * angle.tangent);
}

// The covered area of the triangle of a, a + ab and a + ac; the area of the whole beam is pi.
float covered_area(vec3 a, vec3 ab, vec3 ac, HalfAngle angle, float z_max) {
  const vec3 b = a + ab;
  const vec3 c = a + ac;
  Border border = Border(0.0, vec2(0.0), vec2(0.0), vec3(0.0), vec3(0.0), false, false);
  follow_edge(a, ab, angle, z_max, border);
  follow_edge(b, ac - ab, angle, z_max, border);
  follow_edge(c, -ac, angle, z_max, border);
  border.twice_area += border.crosses_near ? sector(border.leaves_near, border.enters_near) : 0.0;
  const vec3 along_far = border.enters_far - border.leaves_far;
  border.twice_area +=
      border.crosses_far ? area_beside_edge(border.leaves_far, along_far, angle, 0.0, 1.0) : 0.0;
  const bool is_inside = is_in_cone(a, angle) && is_in_cone(b, angle) && is_in_cone(c, angle) &&
                         min(a.z, min(b.z, c.z)) > 0.0 && max(a.z, max(b.z, c.z)) <= z_max;
  const float twice = is_inside ? twice_area_inside(a, ab, ac, angle) : abs(border.twice_area);
  return 0.5 * clamp(twice, 0.0, 6.2831853);
}

#endif
