// The step of a cone from a node of a geometry's tree to its children, the nearest child first.
//
// Included after cone.glsl, the binding `nodes`, and what query/nearest_first.glsl needs.
#ifndef RTSTDB_QUERY_CONE_CHILDREN_GLSL
#define RTSTDB_QUERY_CONE_CHILDREN_GLSL
#include "query/nearest_first.glsl"

// Returns the child whose bound is least and pushes the others within reach.
uint nearest_triangle_child(uint node, ConeInFrame there) {
  const WideNode wide = fetch_geometry_node(nodes, node, there);
  uint nearest = ref_none;
  float nearest_bound = nowhere;
  [[unroll]] for (uint k = 0u; k < 8u; ++k)
      offer_child(child_reference(wide, k), geometry_child_bound(there, wide, k), nearest, nearest_bound);
  return unless_full(nearest);
}

#endif
