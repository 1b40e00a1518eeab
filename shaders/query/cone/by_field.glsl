// The first contact of a cone with an entity by sphere tracing the distance field of its geometry (paper,
// Section 5.2, Figure 6).
//
// A point of the axis with the axial coordinate p has the distance p sine from the cone's surface. A sphere
// around it, without a surface inside and of a radius D above that, contains the part of the cone between the
// axial coordinates p cosine^2 -+ cosine sqrt(D^2 - (p sine)^2). So with p = free / cosine^2, where the cone
// is known to be free up to `free`, the next `free` follows. Where D is not above p sine, the triangle that
// is nearest is searched: the field shows where to search, and triangles decide what is met.
//
// Included after the searches of cone.comp.
#ifndef RTSTDB_QUERY_CONE_BY_FIELD_GLSL
#define RTSTDB_QUERY_CONE_BY_FIELD_GLSL
#include "query/field.glsl"
#include "query/nearest/geometry.glsl"

// Steps of one cone in one field, and searches for the nearest triangle, after which the entity is searched
// by its triangles.
const uint max_field_steps = 192u;
const uint max_field_searches = 12u;

// Wider cones are searched by triangles: the sphere of a step covers little of their surface.
bool is_narrow(HalfAngle angle) { return angle.cosine >= 0.70710678; }

struct FieldMarch {
  float free;  // metres along the axis
  float p;     // of the sphere's centre
  float radius;
  bool is_near;     // the sphere may touch the surface
  bool is_settled;  // the cone meets nothing in reach, or its contact is known
  bool by_triangles;
  uint steps;
};

// A lower bound of the distance, in metres, at the axial coordinate p.
float free_distance_at(ConeInFrame there, DistanceField field, float min_scale, float p) {
  const vec3 in_frame = p * there.slopes.axis / there.scale - there.axis.minus_o;
  const vec3 in_cells = (in_frame - field.origin) / field.edge;
  const vec3 inside = clamp(in_cells, vec3(0.0), vec3(field.cells));
  const float gap = length((in_cells - inside) * field.edge * there.scale);
  // Non-uniform scales lengthen the distance by at least the least scale.
  return max(gap, min_scale * free_distance(field, inside) - gap);
}

// Steps until the surface may be near.
void step_along(ConeInFrame there, TracedCone cone, DistanceField field, float min_scale, float last,
                inout FieldMarch march) {
  const float per_square = 1.0 / (cone.angle.cosine * cone.angle.cosine);
  march.is_near = false;
  if (!march.is_settled) do {
      ++rounds;
      if (!march.is_settled && !march.is_near) {
        const float p = march.free * per_square;
        const float radius = p * cone.angle.sine;
        const float distance = free_distance_at(there, field, min_scale, p);
        const float advance = max(distance * distance - radius * radius, 0.0);
        const bool is_near = distance <= radius * (1.0 + 1e-5);
        const float next = march.free + cone.angle.cosine * sqrt(advance);
        march.p = p;
        march.radius = radius;
        march.is_near = is_near;
        march.free = is_near ? march.free : next;
        ++march.steps;
        const bool is_past = !is_near && (next > box_limit || next > last);
        march.by_triangles = march.by_triangles || march.steps > max_field_steps;
        march.is_settled = is_past || march.by_triangles;
      }
    } while (!march.is_settled && !march.is_near);
}

// Inserts the first contact with the entity. False: it has to be searched by its triangles.
bool search_field(ConeInFrame there, TracedCone cone, Instance i, bool has_field, uint field_texel,
                  uint place) {
  const DistanceField field = fetch_field(has_field ? field_texel : 0u);
  const float min_scale = min(i.scale.x, min(i.scale.y, i.scale.z));
  const float max_scale = max(i.scale.x, max(i.scale.y, i.scale.z));
  const float cell = brick_cell_edge(field);
  const vec3 lo = (field.origin + there.axis.minus_o) * i.scale;
  const vec3 hi = lo + field.edge * vec3(field.cells) * i.scale;
  const vec3 farther = max(there.slopes.axis * lo, there.slopes.axis * hi);
  const float last = farther.x + farther.y + farther.z;
  FieldMarch march;
  march.free = box_bound(there.slopes, lo, hi);
  march.p = march.radius = 0.0;
  march.is_near = false;
  march.steps = 0u;
  march.by_triangles = !has_field;
  march.is_settled = !has_field || march.free > box_limit;
  uint searches = 0u;
  if (!march.is_settled) do {
      rounds += 2u;  // this loop's, and one for the loop inside
      step_along(there, cone, field, min_scale, last, march);
      if (march.is_near) {
        const float reach_before = reach;
        const float blur = 2e-6 * (march.p + there.farthest_m.x);
        const vec3 center = march.p * there.slopes.axis - there.axis.minus_o * i.scale;
        const float radius = march.radius + cell * max_scale + blur;
        const NearestSlot nearest = nearest_slot(i.blas_root, i.scale, center, radius);
        set_reach(reach_before, cone.m_per_lambda);
        const bool found = nearest.triangle != no_triangle;
        const TriangleContact contact = contact_with(there, cone, found ? nearest.slot : 0u);
        const float distance = sqrt(nearest.square);
        const bool touches = distance <= march.radius * (1.0 + 1e-5) + blur;
        // Within a tenth of a cell the nearest triangle counts as the first one, which is the precision of
        // the field.
        const bool is_close = distance <= march.radius + 0.1 * cell * min_scale + blur;
        const bool is_met = found && contact.found && is_close;
        const Candidate candidate =
            Candidate(contact.lambda, place, nearest.triangle, nearest.slot | contact_by_field_bit);
        if (is_met && contact.lambda <= reach) {
          insert(candidate);
          set_reach(min(reach, list[LIST_SIZE - 1u].lambda), cone.m_per_lambda);
        }
        ++searches;
        // The true distance leads on where the triangle is beside the cone.
        const float advance = max(distance * distance - march.radius * march.radius, 0.0);
        const float next = march.free + cone.angle.cosine * sqrt(advance);
        march.free = next;
        march.by_triangles = !is_met && (touches || searches >= max_field_searches);
        march.is_settled = is_met || march.by_triangles || next > box_limit || next > last;
      }
      cut_short = cut_short || rounds > max_rounds;
    } while (!march.is_settled && !cut_short);
  return !march.by_triangles;
}

#endif
