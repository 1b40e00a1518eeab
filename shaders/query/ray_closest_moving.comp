#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The nearest hit of each ray; rays may ask at different instants and move with entities.
#define RAY_MOVING
#include "query/ray_alone.glsl"
