#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by their oriented bounds.
#define NEAREST_BOUNDS
#include "query/nearest.glsl"
