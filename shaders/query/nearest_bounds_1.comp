#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by their oriented bounds: the nearest one.
#define NEAREST_BOUNDS
#define LIST_SIZE 1
#include "query/nearest.glsl"
