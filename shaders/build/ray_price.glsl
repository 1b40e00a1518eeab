// What a ray pays, per area of a box: for the children of a node, and for a triangle.
#ifndef RTSTDB_BUILD_RAY_PRICE_GLSL
#define RTSTDB_BUILD_RAY_PRICE_GLSL

const float node_cost = 1.0;
const float triangle_cost = 0.3;

#endif
