#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How many entities boxes hold, by their triangles.
#define REGION_SURFACE
#define REGION_COUNT
#define REGION_BOX
#include "query/region_triangles.glsl"
