#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Up to 16 hits of each ray, in order.
#define RAY_MOVING
#define RAY_LIST 16u
#include "query/ray_alone.glsl"
