// Reads the normal and the colour at points of triangles. A point is its geometry and its triangle (bits), u
// and v.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tests/gpu/shaders/prelude.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { CountArgs args; };
layout(set = 0, binding = 0) uniform usamplerBuffer geometries;
layout(set = 0, binding = 1) uniform usamplerBuffer attributes;
layout(set = 0, binding = 2, scalar) readonly buffer Points { vec4 points[]; };
layout(set = 0, binding = 3, scalar) writeonly buffer Values { vec3 values[]; };

#include "common/corner_attributes.glsl"
#include "shared/entity.h"

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.count) return;
  const vec4 point = points[i];
  const uint geometry = floatBitsToUint(point.x);
  const uint first = texelFetch(geometries, int(geometry * geometry_texels) + 7).z;
  const CornerAttributes at = corner_attributes(first, floatBitsToUint(point.y), point.z, point.w);
  values[2u * i] = at.normal;
  values[2u * i + 1u] = at.color;
}
