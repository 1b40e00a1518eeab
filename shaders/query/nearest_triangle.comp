#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Triangles, several of an entity where they are nearest.
#define NEAREST_TRIANGLE
#include "query/nearest.glsl"
