#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The nearest hit of each ray; neighbours run side by side, at different instants or with an entity.
#define RAY_MOVING
#include "query/ray_packet.glsl"
