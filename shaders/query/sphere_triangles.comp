#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// What spheres hold: triangles.
#define REGION_SPHERE
#include "query/region_triangles.glsl"
