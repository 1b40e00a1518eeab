// Counts its invocations.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tests/gpu/shaders/prelude.glsl"

layout(local_size_x = 32) in;
layout(set = 0, binding = 0, scalar) buffer Counter { uint counter; };

void main() { atomicAdd(counter, 1); }
