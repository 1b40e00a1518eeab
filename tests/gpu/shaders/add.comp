// Adds an amount to words [first, first + count).
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tests/gpu/shaders/prelude.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { AddArgs args; };
layout(set = 0, binding = 0, scalar) buffer Words { uint words[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i < args.count) words[args.first + i] += args.amount;
}
