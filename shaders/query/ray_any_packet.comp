#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Whether each ray hits anything; neighbours run side by side and ask at one instant.
#define RAY_ANY
#include "query/ray_packet.glsl"
