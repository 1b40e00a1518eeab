// The arguments of every ray kernel.
#ifndef RTSTDB_QUERY_RAY_RAY_ARGS_GLSL
#define RTSTDB_QUERY_RAY_RAY_ARGS_GLSL
#include "shared/query.h"

layout(push_constant, scalar) uniform Push { RayArgs args; };

#endif
