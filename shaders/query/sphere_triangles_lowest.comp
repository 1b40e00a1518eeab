#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The lowest triangles of spheres that found more than they have room for.
#define REGION_LOWEST
#define REGION_SPHERE
#include "query/region_triangles.glsl"
