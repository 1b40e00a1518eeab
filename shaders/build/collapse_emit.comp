#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/prelude.glsl"
// One level of the collapse, 2 of 2: writes the level's wide nodes but for their boxes and queues their inner children.
#include "build/phase_collapse.glsl"

layout(local_size_x = 64) in;
layout(push_constant, scalar) uniform Push { BuildArgs args; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= args.level_count) return;
  if (args.count == 1u) {
    write_single_leaf_root();
    return;
  }
  const uvec2 entry = queue[args.queue_half * args.half_size + i];
  const WideChildren children = choose_children(entry.x);
  uint next = args.level_first + args.level_count + offsets[i];
  write_tree_node(entry.y, children, next);
  uint place = (1u - args.queue_half) * args.half_size + offsets[i];
  for (uint k = 0u; k < children.count; ++k) {
    if (is_inner(children.child[k])) queue[place++] = uvec2(children.child[k], next++);
  }
}
