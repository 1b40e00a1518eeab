#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// What frusta hold: triangles.
#define REGION_FRUSTUM
#include "query/region_triangles.glsl"
