#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Whether each ray hits anything; rays may move with entities.
#define RAY_ANY
#define RAY_CARRIED
#include "query/ray.glsl"
