#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The lowest entities of boxes that found more than they have room for, by their triangles.
#define REGION_SURFACE
#define REGION_LOWEST
#define REGION_BOX
#include "query/region_triangles.glsl"
