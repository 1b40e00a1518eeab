#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
#define BUILD_TLAS
#define TREE_WRITES
#include "build/tree_root.glsl"
