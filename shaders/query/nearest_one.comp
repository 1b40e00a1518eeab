#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The one nearest triangle.
#define NEAREST_ONE
#include "query/nearest.glsl"
