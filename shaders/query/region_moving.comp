#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
#define REGION_MOVING
// Regions that ask at different instants.
#include "query/region.glsl"
