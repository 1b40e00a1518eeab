// What every shader of these tests begins with.
#extension GL_EXT_scalar_block_layout : require
#extension GL_GOOGLE_include_directive : require
#include "tests/gpu/shaders/args.h"
