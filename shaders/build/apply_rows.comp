#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Scatters rows that changed into a slot's copy of the rows.
#include "shared/entity.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ApplyRowsArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ChangedBuffer { EntityRecord changed[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer RowsBuffer { EntityRecord rows[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i < args.count) rows[changed[i].index] = changed[i];
}
