#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The nearest hit of each ray; two lanes have one, at different instants or with an entity.
#define RAY_LANE_PAIRS
#define RAY_MOVING
#include "query/ray.glsl"
