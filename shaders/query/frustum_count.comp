#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// How many frusta find.
#define REGION_FRUSTUM
#define REGION_COUNT
#define REGION_MOVING
#include "query/region.glsl"
