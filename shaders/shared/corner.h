// Normals and colours of the corners of triangles (TriangleMesh), for images.
#ifndef RTSTDB_SHARED_CORNER_H
#define RTSTDB_SHARED_CORNER_H
#include "shared/interop.h"

// All lie in one pool of texels of uvec4. A geometry's begin at GeometryRecord::attributes, in the order of
// the triangles of its mesh, 2 texels each:
//   0 normals of the corners, colour of the first one      1 colours of the others, -, -
// A normal is a direction in 32 bits (common/octahedron.glsl), or corner_normal_none. A colour is red, green
// and blue encoded as in sRGB, a byte each from the lowest on, and 255.
RTSTDB_CONSTANT(corner_texels, 2)
// No direction has these bits.
RTSTDB_CONSTANT(corner_normal_none, 0x80008000u)
// A geometry without corner normals and colours.
RTSTDB_CONSTANT(attributes_none, 0xFFFFFFFFu)

#endif
