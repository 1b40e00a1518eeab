#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Writes changed rows to a slot's copy of the rows.
#include "shared/entity.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { ApplyRowsArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer ChangedBuffer { EntityRecord changed[]; };
layout(set = 0, binding = 1, scalar) writeonly buffer RowsBuffer { EntityRecord rows[]; };

void main() {
  if (gl_GlobalInvocationID.x >= args.count) return;
  const EntityRecord row = changed[args.first + gl_GlobalInvocationID.x];
  rows[row.index] = row;
}
