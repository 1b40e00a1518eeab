// Where a path meets a surface: what all kernels that shade read there, and the rays that they write.
#ifndef RTSTDB_QUERY_IMAGE_PATH_VERTEX_GLSL
#define RTSTDB_QUERY_IMAGE_PATH_VERTEX_GLSL
#include "query/image/hit_input.glsl"
#include "query/image/image.glsl"
#include "query/image/path_input.glsl"
#include "query/image/ray_output.glsl"

layout(set = 0, binding = 4) uniform usamplerBuffer hits;
layout(set = 0, binding = 5) uniform usamplerBuffer shadow_hits;
layout(set = 0, binding = 6, scalar) writeonly buffer RaysBuffer { vec4 rays[]; };
layout(set = 0, binding = 7, scalar) writeonly buffer ShadowRaysBuffer { vec4 shadow_rays[]; };
layout(set = 0, binding = 8, scalar) readonly buffer MaterialsBuffer { MaterialRecord materials[]; };
layout(set = 0, binding = 9, scalar) readonly buffer LightsBuffer { LightRecord lights[]; };
layout(set = 0, binding = 10, scalar) readonly buffer EmittersBuffer { EmitterTriangle emitters[]; };
layout(set = 0, binding = 11) uniform samplerBuffer albedo;
layout(set = 0, binding = 13) uniform usamplerBuffer geometries;
layout(set = 0, binding = 14) uniform usamplerBuffer attributes;
layout(set = 0, binding = 15) uniform samplerBuffer states;
layout(set = 0, binding = 12, scalar) writeonly buffer ActivityBuffer {
  uint some_ray;
  uint some_shadow_ray;
};

#include "common/corner_attributes.glsl"
#include "query/image/surface.glsl"
#include "query/image/lights.glsl"

// Bounds of the distance of a computed point from its surface: world_precision times its world coordinates,
// plus body_precision times the sum of its distance from the ray's origin and its coordinates in the frame of
// its body.
const float world_precision = 5e-7;
const float body_precision = 2e-6;

// Where a ray from a surface starts: off the surface, on the side to which it leads.
vec3 start_of(vec3 point, vec3 n, vec3 to, float clearance_m) {
  precise vec3 start = point + (dot(to, n) >= 0.0 ? 1.0 : -1.0) * clearance_m * n;
  return start;
}

void write_ray(uint place, OutputRay ray) {
  for (uint k = 0u; k < 3u; ++k) rays[ray_texels * place + k] = ray_texel(ray, k);
}

void write_shadow_ray(uint place, OutputRay ray) {
  for (uint k = 0u; k < 3u; ++k) shadow_rays[ray_texels * place + k] = ray_texel(ray, k);
}

void end_path(uint place, PathRecord path) {
  path.flags = 0u;
  paths[args.write_from + place] = path;
  const OutputRay none = no_ray(path.origin_m, path.direction, path.t_ns);
  write_ray(place, none);
  write_shadow_ray(place, none);
}

// The normal and the colour of the point by the corners of its triangle. The normal is in the world and on
// the side of `n`, that of the triangle. `index`: of the instance `i`.
CornerAttributes attributes_at(InputHit hit, uint index, Instance i, int t_ns, vec3 n, vec3 toward) {
  const uint geometry = geometry_of_instance(instances, index);
  const uint first = texelFetch(geometries, int(geometry * geometry_texels) + 7).z;
  CornerAttributes found = corner_attributes(first, hit.triangle, hit.uv.x, hit.uv.y);
  if (found.normal != vec3(0.0)) {
    found.normal = normalize(rotate(orientation_of(i, t_ns), found.normal / i.scale));
    if (dot(found.normal, n) < 0.0) found.normal = -found.normal;
  }
  // A point that is seen can not be lit from behind the seen side.
  if (dot(found.normal, toward) <= 0.0) found.normal = n;
  return found;
}

// A point of a surface, as the path sees it.
struct PathVertex {
  vec3 point;
  vec3 n;      // of the triangle, on the seen side
  vec3 start;  // of the rays that leave on the seen side; lights are seen from here
  Surface surface;
  vec3 emission_cdpm2;
  float clearance_m;  // see start_of
  Instant at;
};

// Returns where the path meets a surface.
PathVertex vertex_of(PathRecord path, InputHit hit) {
  PathVertex vertex;
  const vec3 direction = normalize(path.direction);
  const vec3 from_origin = hit.lambda * path.direction;
  const MaterialRecord material = materials[hit.material];
  const bool from_front = dot(hit.n_world, direction) <= 0.0;
  vertex.at = instant_of(path.t_ns);
  vertex.point = path.origin_m + from_origin;
  vertex.n = from_front ? hit.n_world : -hit.n_world;
  vertex.emission_cdpm2 = material.emission_cdpm2;
  const uint index = places[hit.entity.x] + vertex.at.instance_base;
  const Instance i = fetch_instance(instances, index);
  const vec3 from_body = vertex.point - position_of(i, vertex.at.t_ns);
  vertex.clearance_m = world_precision * largest_coordinate(vertex.point) +
                       body_precision * (largest_coordinate(from_origin) + largest_coordinate(from_body));
  vertex.start = start_of(vertex.point, vertex.n, vertex.n, vertex.clearance_m);
  const CornerAttributes corners = attributes_at(hit, index, i, vertex.at.t_ns, vertex.n, -direction);
  vertex.surface =
      surface_of(material, material.base_color * corners.color, corners.normal, -direction, from_front);
  return vertex;
}

// The light of a light's point that the surface scatters along the path, if nothing is between. Writes the
// shadow ray that searches what is between.
vec3 light_over_shadow_ray(uint place, PathRecord path, PathVertex vertex, uint mask, LightSample light,
                           vec3 scattered_share) {
  const bool is_in_front = dot(light.to, vertex.n) > 0.0;
  const vec3 found = is_in_front ? path.throughput * scattered_share * light.light : vec3(0.0);
  const bool has_shadow_ray = found != vec3(0.0);
  write_shadow_ray(
      place, has_shadow_ray ? OutputRay(vertex.start, light.to, 0.0,
                                        light.is_infinite ? 1e30 : 1.0 - light.end_clearance, path.t_ns, mask)
                            : no_ray(vertex.point, path.direction, path.t_ns));
  if (has_shadow_ray) some_shadow_ray = 1u;
  return found;
}

// Ends the bounce: the path goes on in a direction, or ends there if `goes_on` is false.
void write_next_ray(uint place, PathRecord path, PathVertex vertex, uint mask, bool goes_on, vec3 direction) {
  path.origin_m = goes_on ? start_of(vertex.point, vertex.n, direction, vertex.clearance_m) : vertex.point;
  if (goes_on) path.direction = direction;
  paths[args.write_from + place] = path;
  write_ray(place, goes_on ? OutputRay(path.origin_m, path.direction, 0.0, 1e30, path.t_ns, mask)
                           : no_ray(path.origin_m, path.direction, path.t_ns));
  if (goes_on) some_ray = 1u;
}

#endif
