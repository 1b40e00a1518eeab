#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Triangles: up to 32.
#define NEAREST_TRIANGLE
#define LIST_SIZE 32
#include "query/nearest.glsl"
