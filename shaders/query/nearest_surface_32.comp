#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by their nearest triangle: up to 32.
#define NEAREST_SURFACE
#define LIST_SIZE 32
#include "query/nearest.glsl"
