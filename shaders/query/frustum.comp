#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Frusta.
#define REGION_FRUSTUM
#define REGION_MOVING
#include "query/region.glsl"
