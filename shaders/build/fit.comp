#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
#include "build/phase_fit.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

void main() {
  if (gl_GlobalInvocationID.x < args.count) {
    fit_from_leaf(gl_GlobalInvocationID.x, args.count);
  }
}
