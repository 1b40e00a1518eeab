#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// What spheres hold: entities, by their triangles.
#define REGION_SURFACE
#define REGION_SPHERE
#include "query/region_triangles.glsl"
