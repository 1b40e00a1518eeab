#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by their oriented bounds: up to 8.
#define NEAREST_BOUNDS
#define LIST_SIZE 8
#include "query/nearest.glsl"
