#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How many boxes and spheres find that ask at different instants.
#define REGION_COUNT
#define REGION_MOVING
#include "query/region.glsl"
