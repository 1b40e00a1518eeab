#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Triangles: the nearest one, which is also the nearest surface.
#define NEAREST_TRIANGLE
#define LIST_SIZE 1
#include "query/nearest.glsl"
