// Writes each texel of both views: 4 words of the first, then 4 words of the second.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "tests/gpu/shaders/prelude.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { CountArgs args; };
layout(set = 0, binding = 0) uniform utextureBuffer uints;
layout(set = 0, binding = 1) uniform textureBuffer floats;
layout(set = 0, binding = 2, scalar) writeonly buffer Texels { uvec4 texels[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.count) return;
  texels[2 * i] = texelFetch(uints, int(i));
  texels[2 * i + 1] = floatBitsToUint(texelFetch(floats, int(i)));
}
