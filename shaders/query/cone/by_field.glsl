// Sphere tracing of a cone in the distance field of a geometry (paper, Section 5.2, Figure 6).
//
// The point of the axis with the axial coordinate p has the distance p sine from the cone's surface. If a
// sphere around it with a radius D > p sine contains no surface, then the part of the cone between the axial
// coordinates p cosine^2 -+ cosine sqrt(D^2 - (p sine)^2) is free. So, if the cone is free up to `free`, the
// point p = free / cosine^2 shows it to be free up to free + cosine sqrt(D^2 - (p sine)^2). If D <= p sine,
// the cone may meet the surface: the triangles in a window of the axis that begins at `free` are searched.
//
// Included after `rounds` and `box_limit` are declared (cone.comp).
#ifndef RTSTDB_QUERY_CONE_BY_FIELD_GLSL
#define RTSTDB_QUERY_CONE_BY_FIELD_GLSL
#include "query/field.glsl"

// After this many steps of a cone in a field, all triangles in the rest of the cone are searched.
const uint max_field_steps = 192u;

// Wider cones are searched by triangles: the sphere of a step covers little of their surface.
bool is_narrow(HalfAngle angle) { return angle.cosine >= 0.70710678; }

struct FieldMarch {
  bool has_field;
  DistanceField field;
  float min_scale;
  float free;       // metres along the axis up to which the cone is free
  float last;       // no part of the geometry is beyond it
  float window;     // length of the next window
  bool is_near;     // the triangles in the next window have to be searched
  bool is_settled;  // the entity's first contact is found, or none is within reach
  uint steps;
};

// Without a field the only window is the whole cone.
FieldMarch begin_march(ConeInFrame there, TracedCone cone, bool has_field, uint texel) {
  FieldMarch march;
  march.has_field = has_field;
  march.field = fetch_field(has_field ? texel : 0u);
  march.min_scale = min(there.scale.x, min(there.scale.y, there.scale.z));
  const vec3 lo = (march.field.origin + there.axis.minus_o) * there.scale;
  const vec3 hi = lo + march.field.edge * vec3(march.field.cells) * there.scale;
  const vec3 farther = max(there.slopes.axis * lo, there.slopes.axis * hi);
  march.free = has_field ? box_bound(there.slopes, lo, hi) : 0.0;
  march.last = has_field ? farther.x + farther.y + farther.z : nowhere;
  march.window = has_field ? brick_cell_edge(march.field) * march.min_scale : nowhere;
  march.is_near = !has_field;
  march.is_settled = has_field && march.free > box_limit;
  march.steps = 0u;
  return march;
}

// A lower bound of the distance, in metres, at the axial coordinate p.
float free_distance_at(ConeInFrame there, FieldMarch march, float p) {
  const DistanceField field = march.field;
  const vec3 in_frame = p * there.slopes.axis / there.scale - there.axis.minus_o;
  const vec3 in_cells = (in_frame - field.origin) / field.edge;
  const vec3 inside = clamp(in_cells, vec3(0.0), vec3(field.cells));
  const float gap = length((in_cells - inside) * field.edge * there.scale);
  // A non-uniform scale multiplies a distance by at least its smallest component.
  return max(gap, march.min_scale * free_distance(field, inside) - gap);
}

// Steps until triangles have to be searched, or no contact is within reach.
void step_along(ConeInFrame there, HalfAngle angle, inout FieldMarch march) {
  const float per_square = 1.0 / (angle.cosine * angle.cosine);
  march.is_near = !march.has_field;
  if (!march.is_settled && !march.is_near) do {
      ++rounds;
      if (!march.is_settled && !march.is_near) {
        const float p = march.free * per_square;
        const float radius = p * angle.sine;
        const float distance = free_distance_at(there, march, p);
        const bool is_near = distance <= radius || march.steps >= max_field_steps;
        const float advance = max(distance * distance - radius * radius, 0.0);
        const float next = march.free + angle.cosine * sqrt(advance);
        // A triangle that touches the sphere has its contact before the far side of the sphere.
        const float window = max(march.window, p - march.free + radius + 0.5 * march.window);
        march.window = march.steps >= max_field_steps ? nowhere : is_near ? window : march.window;
        march.free = is_near ? march.free : next;
        march.is_near = is_near;
        march.is_settled = !is_near && (next > box_limit || next > march.last);
        ++march.steps;
      }
    } while (!march.is_settled && !march.is_near);
}

#endif
