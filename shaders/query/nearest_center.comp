#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Entities by the centre of their bounds.
#define NEAREST_CENTER
#include "query/nearest.glsl"
