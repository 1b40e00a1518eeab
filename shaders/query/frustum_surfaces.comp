#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// What frusta hold: entities, by their triangles.
#define REGION_FRUSTUM
#define REGION_SURFACE
#include "query/region_triangles.glsl"
