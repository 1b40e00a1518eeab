#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Tree builder, step 2: Morton codes, which are sorted next.
#include "build/tree_scratch.glsl"
#include "common/morton.glsl"

layout(local_size_x = 64) in;

void main() {
  vec3 lo;
  vec3 hi;
  for (uint axis = 0u; axis < 3u; ++axis) {
    lo[axis] = unordered(~state[blas_center_min + axis]);
    hi[axis] = unordered(state[blas_center_max + axis]);
  }
  const uint end = tile_end();
  for (uint i = tile_begin(); i < end; i += 64u) {
    const uvec2 code = morton_code(center_of(box_of_primitive(i)), lo, hi);
    sorted[i] = uvec2(code.y, i);
    words[i] = code.x;
  }
}
