#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
#include "build/tree_centers.glsl"
