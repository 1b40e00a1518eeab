#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by the centre of their bounds, where all points ask at the window's one instant: the nearest.
#define NEAREST_CENTER
#define NEAREST_STILL
#define LIST_SIZE 1
#include "query/nearest.glsl"
