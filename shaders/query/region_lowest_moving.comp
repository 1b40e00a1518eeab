#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
#define REGION_LOWEST
#define REGION_MOVING
// The same where regions ask at different instants.
#include "query/region.glsl"
