#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Whether each ray hits anything.
#define RAY_ANY
#include "query/ray_alone.glsl"
