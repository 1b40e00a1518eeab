#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// First hits with the rasteriser: each pixel's ray meets the triangle that was drawn there, by the test of
// the ray queries. Where it misses that triangle, its search is left incomplete, so that it is traced.
// Where nothing was drawn, it hits nothing.
#include "query/ray/traverse.glsl"
#include "query/ray/ray_buffers.glsl"

layout(local_size_x = 64) in;
layout(set = 0, binding = 7, scalar) readonly buffer DrawnBuffer { uvec2 drawn[]; };

const uint nothing_drawn = 0xFFFFFFFFu;

void main() {
  const uint place = place_of_invocation(args.first, args.per_group);
  if (place >= args.end || skips_when_halted(args.halt, place + args.halt_from)) return;
  const TracedRay ray = read_ray(place);
  const uint pixel = floatBitsToUint(texelFetch(rays, int(place * ray_texels) + 3).x);
  const uvec2 covers = pixel == nothing_drawn ? uvec2(nothing_drawn) : drawn[pixel];
  Found found = nothing_within(ray.lambda_max);
  if (covers.x != nothing_drawn) {
    const Instance candidate = instance_at(covers.x);
    const Segment segment = enter_instance(make_segment(-ray.origin, ray.direction), candidate, ray.t_ns,
                                           head_of(candidate.blas_root));
    test_triangle(segment, covers.y, ray.lambda_min, args.faces, covers.x, candidate.entity, found);
    if (found.status != status_hit) found.status = status_incomplete;
  }
  answer(place, found, ray);
}
