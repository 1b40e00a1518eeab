// Writes the counts of an indirect dispatch.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tests/gpu/shaders/prelude.glsl"

layout(local_size_x = 1) in;
layout(push_constant, scalar) uniform Push { GroupsArgs args; };
layout(set = 0, binding = 0, scalar) writeonly buffer Counts { uint counts[]; };

void main() {
  counts[args.offset_words] = args.groups;
  counts[args.offset_words + 1] = 1;
  counts[args.offset_words + 2] = 1;
}
