#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// First hits with the rasteriser: each pixel's ray meets the triangle that was drawn there, by the test of
// the ray queries. Where it misses that triangle, its search is left incomplete, so that it is traced.
// Where nothing was drawn, it hits nothing.
#include "query/image/hit_outputs.glsl"
#include "query/image/ray_output.glsl"
#include "query/ray/ray_triangle.glsl"
#include "query/ray/traced_ray.glsl"
#include "shared/node.h"

layout(set = 0, binding = 4, scalar) writeonly buffer RaysBuffer { vec4 rays[]; };
layout(set = 0, binding = 5, scalar) readonly buffer DrawnBuffer { uvec2 drawn[]; };
layout(set = 0, binding = 6) uniform samplerBuffer triangles;
layout(set = 0, binding = 7) uniform usamplerBuffer nodes;
layout(set = 0, binding = 8) uniform usamplerBuffer identities;
layout(set = 0, binding = 9, scalar) writeonly buffer HitsBuffer { uvec2 hits[]; };
layout(set = 0, binding = 10, scalar) writeonly buffer IncompleteBuffer { uint some_incomplete; };

const uint nothing_drawn = 0xFFFFFFFFu;

// What the ray meets of the drawn triangle.
InputHit hit_of_drawn(CameraRay from_camera, CameraRecord camera, uvec2 covers) {
  const Instant at = instant_of(from_camera.t_ns);
  TracedRay ray = TracedRay(from_camera.origin, from_camera.direction, 1.0, vec3(0.0), camera.near_m, 1e30,
                            camera.mask, at.t_ns, at.instance_base, 0.0);
  scale_direction(ray);
  const Instance i = fetch_instance(instances, covers.x);
  const uvec4 root = texelFetch(nodes, int(i.blas_root * node_texels));
  const Segment segment = enter_instance(make_segment(-ray.origin, ray.direction), i, ray.t_ns, root);
  const int corner = int(covers.y * triangle_texels);
  const vec4 a = texelFetch(triangles, corner);
  const vec4 b = texelFetch(triangles, corner + 1);
  const vec4 c = texelFetch(triangles, corner + 2);
  Found found = nothing_within(ray.lambda_max);
  test_corners(segment, a, b, c.xyz, covers.y, ray.lambda_min, 0.0, covers.x, i.entity, found);
  const uvec4 identity = texelFetch(identities, int(i.entity));
  InputHit hit;
  hit.status = found.status;
  hit.lambda = found.lambda * ray.unit;
  hit.uv = vec2(found.u, found.v);
  hit.entity = identity.xy;
  hit.material = identity.w;
  hit.triangle = found.triangle;
  hit.front = found.front;
  hit.n_world = world_normal(i, ray.t_ns, a.xyz, b.xyz, c.xyz);
  hit.v_world = velocity_at(i, ray.t_ns, ray.origin + found.lambda * ray.direction);
  return hit;
}

void main() {
  const uint place = started_place();
  if (place >= args.end) return;
  const Pixel pixel = pixel_of(place);
  if (!pixel.is_inside) return;
  const CameraRecord camera = cameras[pixel.image];
  const CameraRay ray = camera_ray(pixel, camera, middle);
  const uvec2 covers = drawn[pixel.image * args.width * args.height + pixel.index];
  const bool is_drawn = covers.x != nothing_drawn;
  InputHit hit = hit_of_drawn(ray, camera, is_drawn ? covers : uvec2(0u));
  if (!is_drawn) hit.status = status_miss;
  const bool is_settled = !is_drawn || hit.status == status_hit;
  if (!is_settled) hit.status = status_incomplete;
  uvec2 pairs[hit_pairs];
  pairs_of(hit, pairs);
  for (uint k = 0u; k < hit_pairs; ++k) hits[hit_pairs * place + k] = pairs[k];
  if (is_settled) {
    write_hit_outputs(pixel, camera, ray, hit);
    return;
  }
  some_incomplete = 1u;
  const OutputRay traced = OutputRay(ray.origin, ray.direction, camera.near_m, 1e30, ray.t_ns, camera.mask);
  for (uint k = 0u; k < 3u; ++k) rays[ray_texels * place + k] = ray_texel(traced, k);
}
