#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The nearest hit of each ray; two lanes have one, and all ask at one instant.
#define RAY_LANE_PAIRS
#include "query/ray.glsl"
