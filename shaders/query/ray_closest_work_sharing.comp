#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// The nearest hit of each ray; lanes work for one another, and rays ask at one instant.
#include "query/ray_work_sharing.glsl"
