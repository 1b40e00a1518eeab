#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by the centre of their bounds: the nearest one.
#define NEAREST_CENTER
#define LIST_SIZE 1
#include "query/nearest.glsl"
