// The signed distance of a point to the body of a side, from the body's distance field or from its triangles.
//
// Included after signed_distance.glsl and field.glsl.
#ifndef RTSTDB_QUERY_CONTACT_SURFACE_SAMPLE_GLSL
#define RTSTDB_QUERY_CONTACT_SURFACE_SAMPLE_GLSL

// Negative inside; `outwards`: the direction in which it grows (unit).
struct Sample {
  vec3 point;
  float distance;
  vec3 outwards;
};

struct DistanceSource {
  bool has_field;
  DistanceField field;
  bool all_points_inside;  // all points whose distances are wanted lie in the body
};

// A field is used if the body has the same scale along all axes.
DistanceSource source_of(SurfaceSide side, bool may_have_field, bool all_points_inside) {
  const uint texel = field_of(side.body);
  const bool is_uniform = side.body_scale.x == side.body_scale.y && side.body_scale.x == side.body_scale.z;
  const bool has_field = may_have_field && is_uniform && texel != field_none && is_signed_field(texel);
  return DistanceSource(has_field, fetch_field(has_field ? texel : 0u), all_points_inside);
}

// False: the point lies so deep in the body that the field there is coarse, and `found` is not to be used.
bool sample_field(SurfaceSide side, DistanceField field, vec3 point, out Sample found) {
  const float scale = side.body_scale.x;
  const vec3 in_cells = (point / scale - field.origin) / field.edge;
  const vec3 inside = clamp(in_cells, vec3(0.0), vec3(field.cells));
  const vec3 beyond = (in_cells - inside) * field.edge;
  const float outside = length(beyond);
  const SignedDistance at = signed_distance(field, inside);
  // The field covers the body and a border around it, so a point beyond the field is outside of the body.
  found = outside > 0.0 ? Sample(point, scale * (outside + max(at.distance, 0.0)), beyond / outside)
                        : Sample(point, scale * at.distance, at.outwards);
  return at.is_fine || found.distance > 0.0;
}

Sample sample_exactly(SurfaceSide side, DistanceSource source, vec3 point) {
  const Foot foot = foot_of(side, point, source.all_points_inside || is_in_body(side, point));
  return Sample(point, foot.is_inside ? -foot.distance : foot.distance, foot.outwards);
}

Sample sample_at(SurfaceSide side, DistanceSource source, vec3 point) {
  Sample found;
  if (source.has_field && sample_field(side, source.field, point, found)) return found;
  return sample_exactly(side, source, point);
}

#endif
