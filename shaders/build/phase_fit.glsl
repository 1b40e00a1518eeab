// Computes the boxes of the inner nodes bottom-up. Of the two children of a node, the invocation that arrives
// second proceeds to the parent. No invocation waits, so the pass assumes no forward progress between
// workgroups. Minimum and maximum do not depend on the order of arrival.
#ifndef RTSTDB_BUILD_PHASE_FIT_GLSL
#define RTSTDB_BUILD_PHASE_FIT_GLSL
#include "build/scratch.glsl"
#include "common/fence.glsl"

Box box_of_child(uint child) {
  // Member by member, since glslang 12 gives the two sides of a conditional over buffer structs different
  // types.
  Box box;
  if ((child & leaf_child_bit) != 0u) {
    const uint primitive = values[child & ~leaf_child_bit];
    box.lo = bounds[primitive].lo;
    box.hi = bounds[primitive].hi;
  } else {
    box.lo = node_bounds[child].lo;
    box.hi = node_bounds[child].hi;
  }
  return box;
}

void fit_from_leaf(uint leaf, uint count) {
  uint node = parents[count - 1u + leaf];
  while (true) {
    divergent_fence();
    if (atomicAdd(arrivals[node], 1u) == 0u) break;
    divergent_fence();
    const uvec4 children = binary[node];
    const Box box = box_union(box_of_child(children.x), box_of_child(children.y));
    node_bounds[node].lo = box.lo;
    node_bounds[node].hi = box.hi;
    if (node == 0u) break;
    node = parents[node];
  }
}

#endif
