#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Boxes and spheres that all ask at one instant.
#include "query/region.glsl"
