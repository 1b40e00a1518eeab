#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The nearest hit of each ray; neighbours run side by side and ask at one instant.
#include "query/ray_packet.glsl"
