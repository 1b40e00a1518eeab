#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Whether each ray hits anything; two lanes have one, and all ask at one instant.
#define RAY_LANE_PAIRS
#define RAY_ANY
#include "query/ray.glsl"
