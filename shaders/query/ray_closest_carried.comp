#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The nearest hit of each ray; rays may move with entities.
#define RAY_CARRIED
#include "query/ray.glsl"
