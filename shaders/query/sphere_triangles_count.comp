#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How many triangles spheres hold.
#define REGION_COUNT
#define REGION_SPHERE
#include "query/region_triangles.glsl"
