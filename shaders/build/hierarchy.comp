#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
#include "build/phase_hierarchy.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

void main() {
  if (gl_GlobalInvocationID.x + 1u < args.count) build_inner_node(int(gl_GlobalInvocationID.x), int(args.count));
}
