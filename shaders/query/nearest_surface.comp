#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by their nearest triangle.
#define NEAREST_SURFACE
#include "query/nearest.glsl"
