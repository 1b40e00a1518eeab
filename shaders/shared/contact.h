// Hulls of convex geometry; requests and results of contact queries.
#ifndef RTSTDB_SHARED_CONTACT_H
#define RTSTDB_SHARED_CONTACT_H
#include "shared/interop.h"

// The hull of a convex geometry, in texels of vec4. Positions are in the entity's frame, unscaled:
//   0         centre of the box, number of corners
//   1         numbers of faces and nodes, offsets of faces and polygons from the hull's first texel
//   2         of a solid with a curved surface: axis of a disc (unit) or zeros, radius; its body consists of
//             the sums of a point of the corners' hull and a point of that disc, or of a ball; else zeros
//   3...      corners; position, -   (some are repeated so that their number is a multiple of 4)
//   nodes     two texels each, right before the faces: centre and radius of a sphere around corners; number
//             of the node behind this one's subtree, first corner and number of corners (0: inner node), -
//   faces     unit normal, first corner of the polygon | number of its corners << 24
//   polygons  position, -
// A hull with more than 256 corners has nodes: a binary tree, each node before its children, the root first.
RTSTDB_CONSTANT(hull_header_texels, 3)
RTSTDB_CONSTANT(hull_corners_per_step, 4)
RTSTDB_CONSTANT(hull_corners_per_leaf, 16)
RTSTDB_CONSTANT(hull_node_texels, 2)
RTSTDB_CONSTANT(hull_max_scanned_corners, 256)
// Corners that are used of a face with more of them, spread over its border.
RTSTDB_CONSTANT(hull_max_polygon_corners, 32)

// A pair of convex bodies in the frame of the second one (not scaled), whose origin is the second hull's
// centre. The low parts are the remainders of single precision.
#define RTSTDB_FIELDS_PairRecord(F)                          \
  F(vec4, q) /* first entity's frame to second's */          \
  F(vec4, q_low)                                             \
  F(vec3, center_m) /* of the first hull */                  \
  F(uint, first_hull) /* texel */                            \
  F(vec3, center_low_m)                                      \
  F(uint, second_hull)                                       \
  F(vec3, first_scale)                                       \
  F(float, margin_m)                                         \
  F(vec3, first_scale_low)                                   \
  F(float, limit_m) /* bodies that are apart by more need no distance */ \
  F(vec3, second_scale)                                      \
  F(float, rounding_m) /* bound of the error of a point in this frame, in single precision */ \
  F(vec3, second_scale_low)                                  \
  F(float, precision_m) /* bounds of the distance are at most this apart */ \
  F(float, omitted_m) /* distance of omitted corners from the hulls, upper bound, of both bodies */
RTSTDB_STRUCT(PairRecord)

// State of a pair after a stage.
RTSTDB_CONSTANT(pair_known, 0)       // bounds within the precision, or the distance is above the limit
RTSTDB_CONSTANT(pair_needs_double, 1)  // the distance is computed again in double precision
RTSTDB_CONSTANT(pair_needs_depth, 2)   // the bodies overlap or are too near to tell: the depth is computed
RTSTDB_CONSTANT(pair_undecided, 3)   // its bounds are wider than the precision
RTSTDB_CONSTANT(pair_unfinished, 4)  // limit of loops: retried

// `point_m`: of the first body, nearest to the second or deepest in it. `n`: unit, from the second body to
// the first. The bounds contain the distance of the exact bodies, whatever the state.
#define RTSTDB_FIELDS_PairResult(F) \
  F(vec3, n)                        \
  F(float, distance_m)              \
  F(vec3, point_m)                  \
  F(uint, state)                    \
  F(float, min_m)                   \
  F(float, max_m)
RTSTDB_STRUCT(PairResult)

// The points of a pair that touches. `points`: midway between the surfaces, depth. Faces are numbers in the
// hulls.
RTSTDB_CONSTANT(max_contact_points, 4)
#define RTSTDB_FIELDS_PairPoints(F) \
  F(vec4, point_0)                  \
  F(vec4, point_1)                  \
  F(vec4, point_2)                  \
  F(vec4, point_3)                  \
  F(uint, count)                    \
  F(uint, first_face)               \
  F(uint, second_face)
RTSTDB_STRUCT(PairPoints)

#define RTSTDB_FIELDS_ContactArgs(F)                   \
  F(uint, first) /* see place_of_invocation */         \
  F(uint, end)                                         \
  F(uint, per_group)                                   \
  F(uvec2, halt) /* this and the next as in RayArgs */ \
  F(uint, halt_from)                                   \
  F(uint, loop_probe) /* see loops_still_turn */
RTSTDB_STRUCT(ContactArgs)

#endif
