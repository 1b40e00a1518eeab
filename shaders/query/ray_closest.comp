#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Closest hit of each ray.
#include "query/ray_alone.glsl"
