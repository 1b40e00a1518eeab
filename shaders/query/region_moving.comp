#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Boxes and spheres that ask at different instants.
#define REGION_MOVING
#include "query/region.glsl"
