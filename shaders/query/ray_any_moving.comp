#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Whether each ray hits anything; rays may ask at different instants and move with entities.
#define RAY_ANY
#define RAY_MOVING
#include "query/ray_alone.glsl"
