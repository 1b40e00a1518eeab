#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The lowest ids of frusta that found more than they have room for.
#define REGION_FRUSTUM
#define REGION_LOWEST
#define REGION_MOVING
#include "query/region.glsl"
