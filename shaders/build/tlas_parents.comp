#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// Records the parent of each node and instance of a TLAS, which patches follow upwards.
#include "shared/build.h"
#include "shared/node.h"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { PatchArgs args; };
layout(set = 0, binding = 0, scalar) readonly buffer WideBuffer { uvec4 wide[]; };
// Parents of the nodes, then of the instances.
layout(set = 0, binding = 1, scalar) writeonly buffer ParentsBuffer { uint parents[]; };

void main() {
  if (gl_GlobalInvocationID.x >= args.count) return;
  const uint node = args.first + gl_GlobalInvocationID.x;
  const uint base = node * tlas_node_texels;
  const uint used = wide[base].w >> 24;
  const uvec4 references[2] = uvec4[2](wide[base + 4u], wide[base + 5u]);
  for (uint slot = 0u; slot < 8u; ++slot) {
    if ((used >> slot & 1u) == 0u) continue;
    const uint reference = references[slot >> 2][slot & 3u];
    const bool leaf = (reference & ref_leaf_bit) != 0u;
    parents[leaf ? args.leaf_parents + (reference & ref_instance_mask) : reference] = node;
  }
}
