// Whether a point lies in the body of a side, which is closed, and the nearest point of the body's surface.
//
// Included after surface.glsl.
#ifndef RTSTDB_QUERY_CONTACT_SIGNED_DISTANCE_GLSL
#define RTSTDB_QUERY_CONTACT_SIGNED_DISTANCE_GLSL
#include "query/nearest/winding.glsl"

struct Foot {
  vec3 offset;     // from the point to the nearest point of the surface
  float distance;  // not below 0
  uint slot;
  bool is_inside;
  vec3 outwards;  // unit: the direction in which the signed distance grows
};

uint visits = 0u;  // of nodes and triangles, by all calls

bool is_in_body(SurfaceSide side, vec3 point) {
  const Winding around = winding_around(root_of(side.body), point / side.body_scale);
  rounds += around.rounds;
  visits += around.rounds;
  cut_short = cut_short || around.cut_short;
  return around.number != 0;
}

Foot foot_of(SurfaceSide side, vec3 point, bool is_inside) {
  const NearestSlot nearest = nearest_slot(root_of(side.body), side.body_scale, point, nowhere, 0.0);
  visits += nearest.visits;
  uint triangle;
  const vec3 offset = nearest_on_slot(nearest.slot, side.body_scale, point, triangle).offset;
  const float distance = length(offset);
  // Within rounding of the surface the direction to the nearest point is arbitrary; the normal replaces it.
  const vec3 front = front_of(body_triangle(side, nearest.slot));
  const vec3 direction = offset / max(distance, 1e-37);
  const vec3 outwards = distance > side.rounding_m ? (is_inside ? direction : -direction) : front;
  return Foot(offset, distance, nearest.slot, is_inside, outwards);
}

#endif
