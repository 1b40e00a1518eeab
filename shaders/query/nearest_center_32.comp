#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by the centre of their bounds: up to 32.
#define NEAREST_CENTER
#define LIST_SIZE 32
#include "query/nearest.glsl"
