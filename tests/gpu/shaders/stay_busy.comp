// Takes time: each step needs the one before it. Stays below the loop limit of lavapipe, 65535 in all.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tests/gpu/shaders/prelude.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { CountArgs args; };
layout(set = 0, binding = 0, scalar) buffer Words { uint words[]; };

void main() {
  uint state = words[gl_GlobalInvocationID.x];
  for (uint i = 0; i < args.count; ++i) state = state * 1664525u + 1013904223u;
  words[gl_GlobalInvocationID.x] = state;
}
