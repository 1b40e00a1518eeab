#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// What boxes and spheres hold: triangles.
#include "query/region_triangles.glsl"
