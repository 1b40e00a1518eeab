#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Triangles: up to 8.
#define NEAREST_TRIANGLE
#define LIST_SIZE 8
#include "query/nearest.glsl"
