// Requests and results of searches for contacts of surfaces: pairs of which at least one body does not
// consist of convex parts.
#ifndef RTSTDB_SHARED_SURFACE_H
#define RTSTDB_SHARED_SURFACE_H
#include "shared/interop.h"

// One side of such a pair: the surface of one entity against the body of the other. Positions, here and in
// the structs below, are in the frame of the body's entity, rotated but not scaled, so that lengths are those
// of the world. `surface` and `body`: indices of geometries.
#define RTSTDB_FIELDS_SurfaceSide(F)                                                       \
  F(vec4, q)              /* the surface's entity frame to the body's */                   \
  F(vec3, origin_m)       /* of the surface's entity */                                    \
  F(uint, surface)                                                                         \
  F(vec3, surface_scale)                                                                   \
  F(uint, body)                                                                            \
  F(vec3, body_scale)                                                                      \
  F(uint, triangles)      /* of the surface */                                             \
  F(float, limit_m)       /* triangles farther than this from the body's box are not near */ \
  F(float, rounding_m)    /* what single precision resolves of the positions */            \
  F(uint, first_word)     /* of the bits of the surface's triangles */
RTSTDB_STRUCT(SurfaceSide)

// The number of invocations that search the near triangles of a side, each in a subtree of the geometry's
// second level.
RTSTDB_CONSTANT(surface_subtrees, 64)
// The number of triangles of a surface whose distance is computed for an upper bound of that of the surfaces.
RTSTDB_CONSTANT(bound_triangles, 64)

// A triangle of a surface that is near the body, by its place in the leaf order of its geometry.
#define RTSTDB_FIELDS_NearTriangle(F) \
  F(uint, side)                       \
  F(uint, place)
RTSTDB_STRUCT(NearTriangle)

// The state of a search for a near triangle or a point.
RTSTDB_CONSTANT(surface_ended, 0)
RTSTDB_CONSTANT(surface_goes_on, 1)     // in the next stage
RTSTDB_CONSTANT(surface_unfinished, 2)  // it reached the limit of loops: retried

// The shortest segment from a near triangle to the other surface; `point_m`: its middle. `distance_m`: 3.4e38
// if there is none within the limit, 0 if the surfaces cross at `point_m`. `n`: unit, from the body to the
// surface.
#define RTSTDB_FIELDS_SurfaceGap(F) \
  F(vec3, point_m)                  \
  F(float, distance_m)              \
  F(vec3, n)                        \
  F(uint, surface_triangle)         \
  F(uint, body_triangle)            \
  F(uint, state)
RTSTDB_STRUCT(SurfaceGap)

// Where a near triangle is.
RTSTDB_CONSTANT(triangle_outside, 0)  // its first corner lies outside of the body
RTSTDB_CONSTANT(triangle_inside, 1)   // its first corner lies in the body
// Its first corner lies outside, and its shortest segment to the other surface ends inside the body that the
// triangle bounds: the segment is no gap between the bodies.
RTSTDB_CONSTANT(triangle_gap_in_body, 2)

// How deep a near triangle lies in the body: points with their depths in metres in w; a depth of 0 or less:
// outside. Depths of corners that come from a distance field are approximate. The search for the deepest
// point goes on from stage to stage: its samples are the corners and a point within the triangle, then, if
// the pair's deepest point may lie in the triangle, the points of a descent
// (shaders/query/contact/surface_descent.comp).
#define RTSTDB_FIELDS_SurfaceDepth(F)                                                              \
  F(vec4, corner_0)                                                                                \
  F(vec4, corner_1)                                                                                \
  F(vec4, corner_2)                                                                                \
  F(vec4, deepest)           /* of the samples so far */                                           \
  F(vec3, outwards)          /* unit: the direction in which the depth decreases there */          \
  F(float, step_m)                                                                                 \
  F(float, max_depth_m)      /* no point of the triangle is deeper */                              \
  F(vec3, rejected_outwards) /* the same at the last sample of the descent that was not deeper */  \
  F(uint, samples)                                                                                 \
  F(uint, follows_valley)                                                                          \
  F(uint, is_refined)        /* samples are taken from the body's triangles, not from its field */ \
  F(uint, surface_triangle)                                                                        \
  F(uint, where)             /* triangle_outside ... */                                            \
  F(uint, state)
RTSTDB_STRUCT(SurfaceDepth)

// Samples before a descent, and the maximum number of steps of a descent by the distance field of the body
// and by its triangles.
RTSTDB_CONSTANT(descent_samples, 4)
RTSTDB_CONSTANT(max_field_descent_steps, 64)
RTSTDB_CONSTANT(max_triangle_descent_steps, 32)

// A point of a surface that was chosen as a contact, in the near triangle of number `near`.
#define RTSTDB_FIELDS_SurfacePoint(F) \
  F(vec3, point_m)                    \
  F(uint, near)
RTSTDB_STRUCT(SurfacePoint)

// The result for a SurfacePoint: its exact depth (negative: outside), the nearest point of the body's
// surface, and the direction in which the depth decreases (unit).
#define RTSTDB_FIELDS_SurfaceFoot(F) \
  F(float, depth_m)                  \
  F(vec3, foot_m)                    \
  F(vec3, outwards)                  \
  F(uint, body_triangle)             \
  F(uint, state)
RTSTDB_STRUCT(SurfaceFoot)

#endif
