#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Whether each ray hits anything; lanes work for one another, and rays ask at one instant.
#define RAY_ANY
#include "query/ray_work_sharing.glsl"
