#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_scalar_block_layout : require
// A corner of a triangle for the rasteriser.
#include "shared/image.h"
#include "shared/node.h"

layout(set = 0, binding = 0) uniform samplerBuffer triangles;
layout(set = 0, binding = 1, scalar) readonly buffer VisibleBuffer { VisibleRecord visible[]; };

layout(location = 0) flat out uvec2 identity;

void main() {
  const VisibleRecord record = visible[gl_InstanceIndex];
  const uint slot = record.first_triangle + uint(gl_VertexIndex) / 3u;
  const int texel = int(slot * triangle_texels) + gl_VertexIndex % 3;
  const vec4 corner = vec4(texelFetch(triangles, texel).xyz, 1.0);
  gl_Position = vec4(dot(record.right, corner), dot(record.down, corner), dot(record.depth, corner),
                     dot(record.w, corner));
  identity = uvec2(record.instance, slot);
}
