#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by the centre of their bounds, where all points ask at the window's one instant: up to 8.
#define NEAREST_CENTER
#define NEAREST_STILL
#define LIST_SIZE 8
#include "query/nearest.glsl"
