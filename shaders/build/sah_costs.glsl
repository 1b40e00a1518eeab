// Costs of the surface area heuristic, per area of a box: for visiting the children of a node, and for
// testing a triangle.
#ifndef RTSTDB_BUILD_SAH_COSTS_GLSL
#define RTSTDB_BUILD_SAH_COSTS_GLSL

const float node_cost = 1.0;
const float triangle_cost = 0.3;

#endif
