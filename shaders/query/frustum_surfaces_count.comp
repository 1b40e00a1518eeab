#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How many entities frusta hold, by their triangles.
#define REGION_FRUSTUM
#define REGION_SURFACE
#define REGION_COUNT
#include "query/region_triangles.glsl"
