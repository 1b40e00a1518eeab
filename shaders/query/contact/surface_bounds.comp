#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// An upper bound of the distance between two surfaces: the least distance of the centres of some triangles of
// the first surface, spread over it, to the second one. It limits the search for the nearest triangles of a
// named pair.
#include "common/halt.glsl"
#include "common/loops.glsl"
#include "common/places.glsl"
#include "shared/contact.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ContactArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer nodes;
layout(set = 0, binding = 1) uniform samplerBuffer triangles;
layout(set = 0, binding = 2) uniform usamplerBuffer geometries;
#include "query/contact/surface.glsl"
layout(set = 0, binding = 3, scalar) readonly buffer SidesBuffer { SurfaceSide sides[]; };
layout(set = 0, binding = 4, scalar) readonly buffer NamedBuffer { uint named[]; };  // sides by place
layout(set = 0, binding = 5, scalar) writeonly buffer BoundsBuffer {
  float bounds[];
};  // metres; below 0: unfinished

void main() {
  const uint index = place_of_invocation(args.first, args.per_group);
  if (index >= args.end) return;
  if (skips_when_halted(args.halt, index + args.halt_from)) return;
  const SurfaceSide side = sides[named[index]];
  const uint first = first_slot_of(side.surface);
  const uint samples = min(side.triangles, bound_triangles);
  float bound = nowhere;
  uint i = 0u;
  do {
    ++rounds;
    if (i < samples) {
      const uint place = uint(uint64_t(i) * side.triangles / samples);
      const vec3 center = center_of(surface_triangle(side, first + place));
      const NearestSlot nearest =
          nearest_slot(root_of(side.body), side.body_scale, center, bound < 1e18 ? bound : 1e18, 0.0);
      bound = nearest.triangle != no_triangle ? min(bound, sqrt(nearest.square)) : bound;
      ++i;
    }
  } while (i < samples && !cut_short);
  cut_short = cut_short || !loops_still_turn(args.loop_probe);
  bounds[index] = cut_short ? -1.0 : bound;
}
