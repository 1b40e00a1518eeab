// Costs of the surface area heuristic, per area of a box: for visiting the children of a node, and for
// testing a triangle.
#ifndef RTSTDB_BUILD_RAY_PRICE_GLSL
#define RTSTDB_BUILD_RAY_PRICE_GLSL

const float node_cost = 1.0;
const float triangle_cost = 0.3;

#endif
