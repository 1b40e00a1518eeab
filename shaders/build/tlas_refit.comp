#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Refits one level of a TLAS.
#include "common/bounds.glsl"
#include "shared/build.h"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { RefitArgs args; };
layout(set = 0, binding = 0, scalar) writeonly buffer MotionBoxesBuffer { MotionBox motion_boxes[]; };
// The same buffer; this dispatch reads boxes of other levels than it writes.
layout(set = 0, binding = 1) uniform usamplerBuffer box_texels;
layout(set = 0, binding = 2, scalar) writeonly buffer WideBuffer { uvec4 wide[]; };
// The same buffer; references and used slots, which do not change.
layout(set = 0, binding = 3) uniform usamplerBuffer tree_texels;

MotionBox fetch_box(uint place) {
  const int base = int(place * motion_box_texels);
  const vec4 t0 = uintBitsToFloat(texelFetch(box_texels, base));
  const vec4 t1 = uintBitsToFloat(texelFetch(box_texels, base + 1));
  const vec4 t2 = uintBitsToFloat(texelFetch(box_texels, base + 2));
  const vec3 overhang = uintBitsToFloat(texelFetch(box_texels, base + 3).xyz);
  return MotionBox(Box(t0.xyz, vec3(t0.w, t1.xy)), Box(vec3(t1.zw, t2.x), t2.yzw), overhang, 0.0);
}

#define BOX_AT(place) fetch_box(place)
#define NODE_TEXEL(place) texelFetch(tree_texels, int(place))
#include "build/phase_refit.glsl"

void main() {
  if (gl_GlobalInvocationID.x < args.count) refit_node(args.first + gl_GlobalInvocationID.x);
}
