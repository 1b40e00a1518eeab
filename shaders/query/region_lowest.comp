#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
#define REGION_LOWEST
// The lowest ids of regions that found more than they have room for.
#include "query/region.glsl"
