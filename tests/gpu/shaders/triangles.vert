#version 460
#extension GL_EXT_scalar_block_layout : require
// Draws the triangles of a buffer, whose corners are in clip coordinates.

layout(set = 0, binding = 0, scalar) readonly buffer Corners { vec4 corners[]; };
layout(location = 0) flat out uvec2 identity;

void main() {
  gl_Position = corners[gl_VertexIndex];
  identity = uvec2(gl_InstanceIndex, gl_VertexIndex / 3);
}
