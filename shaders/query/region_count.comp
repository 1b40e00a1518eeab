#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How many boxes and spheres find that all ask at one instant.
#define REGION_COUNT
#include "query/region.glsl"
