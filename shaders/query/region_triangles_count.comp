#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How many triangles boxes and spheres hold.
#define REGION_COUNT
#include "query/region_triangles.glsl"
