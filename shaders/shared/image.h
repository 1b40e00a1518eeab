// Images: cameras, paths of light, materials and lights on the device.
#ifndef RTSTDB_SHARED_IMAGE_H
#define RTSTDB_SHARED_IMAGE_H
#include "shared/interop.h"

// A tile is a square of pixels, or as much of it as an image has that is smaller. The pixels of a group of
// tiles are places 0 to image_group_pixels - 1: tile by tile, row by row within a tile.
RTSTDB_CONSTANT(image_tile_side, 16)
RTSTDB_CONSTANT(image_group_pixels, 65536)

// One camera of a batch. Addresses are of the image's first pixel, low word first; 0: the output is not
// wanted.
#define RTSTDB_FIELDS_CameraRecord(F)                                                            \
  F(vec3, p_m)                                                                                   \
  F(uint, mask)                                                                                  \
  F(vec4, q)                                                                                     \
  F(float, tan_half_x) /* of half the horizontal angle */                                        \
  F(float, tan_half_y)                                                                           \
  F(float, near_m)                                                                               \
  F(uint, carrier) /* index, or no_entity */                                                     \
  F(uint, t_ns)    /* low word of the begin of row 0's exposure */                               \
  F(uint, row_ns)                                                                                \
  F(uint, exposure_ns)                                                                           \
  F(uint, seed)                                                                                  \
  F(float, white_cdpm2) /* the luminance of sRGB white */                                        \
  F(uvec2, color)                                                                                \
  F(uvec2, srgb)                                                                                 \
  F(uvec2, depth)                                                                                \
  F(uvec2, entities)                                                                             \
  F(uvec2, triangles)                                                                            \
  F(uvec2, materials)                                                                            \
  F(uvec2, normals)                                                                              \
  F(uvec2, motion)
RTSTDB_STRUCT(CameraRecord)

RTSTDB_CONSTANT(path_alive, 1)
// No shadow ray could have found what the ray meets: it comes from the camera, a smooth mirror or glass.
RTSTDB_CONSTANT(path_without_shadow_ray, 2)

// The state of the path of one pixel. Each stage reads the state that the one before it wrote and writes
// another, so that a chunk that is executed again has the same result.
#define RTSTDB_FIELDS_PathRecord(F)                                                              \
  F(vec3, origin_m) /* of the ray that is searched next */                                       \
  F(uint, t_ns)     /* low word */                                                               \
  F(vec3, direction)                                                                             \
  F(float, pdf) /* per steradian, with which the direction was chosen */                         \
  F(vec3, throughput)                                                                            \
  F(uint, flags)                                                                                 \
  F(vec3, radiance_cdpm2) /* of this sample so far */                                            \
  F(uint, bounces)                                                                               \
  F(vec3, shadowed_cdpm2) /* is added if the shadow ray meets nothing; see also image_gather.comp */ \
  F(float, seen)          /* image_gather.comp */                                                \
  F(vec3, sum_cdpm2) /* of the samples before */                                                 \
  F(uint, unused)
RTSTDB_STRUCT(PathRecord)
RTSTDB_CONSTANT(path_texels, 6)

// An instance as the rasteriser sees it: a point of its entity's frame has the clip coordinates dot(right,
// p), dot(down, p), dot(depth, p), dot(w, p) with p = (point, 1).
#define RTSTDB_FIELDS_VisibleRecord(F)                                                           \
  F(vec4, right)                                                                                 \
  F(vec4, down)                                                                                  \
  F(vec4, depth)                                                                                 \
  F(vec4, w)                                                                                     \
  F(uint, first_triangle)                                                                        \
  F(uint, instance)
RTSTDB_STRUCT(VisibleRecord)

// A material (rtstdb/material.hpp).
#define RTSTDB_FIELDS_MaterialRecord(F)                                                          \
  F(vec3, base_color)                                                                            \
  F(float, metallic)                                                                             \
  F(vec3, emission_cdpm2)                                                                        \
  F(float, roughness)                                                                            \
  F(float, transmission)                                                                         \
  F(float, refractive_index)                                                                     \
  F(float, retro_gain)                                                                           \
  F(float, unused)
RTSTDB_STRUCT(MaterialRecord)

// The kinds of lights: those of rtstdb::LightKind, and an entity whose material emits light.
RTSTDB_CONSTANT(light_directional, 0)
RTSTDB_CONSTANT(light_point, 1)
RTSTDB_CONSTANT(light_spot, 2)
RTSTDB_CONSTANT(light_sky, 3)
RTSTDB_CONSTANT(light_emitter, 4)

// A light of a batch, moved by its entity, or at rest (no_entity). `color`: its channels in lx, cd or cd/m2;
// of a sky at the zenith.
// In the buffer come skies, then directional lights, then other lights, then surfaces by entity index.
#define RTSTDB_FIELDS_LightRecord(F)                                                             \
  F(uint, kind)                                                                                  \
  F(uint, entity)                                                                                \
  F(uint, first_triangle) /* of a surface, in the buffer of emitting triangles */                \
  F(uint, triangles)      /* of a surface */                                                     \
  F(vec3, color)                                                                                 \
  F(uint, mask)                                                                                  \
  F(vec3, horizon)                                                                               \
  F(float, cos_inner) /* of a spot; of half its angle */                                         \
  F(vec3, ground)                                                                                \
  F(float, cos_outer) /* of a spot; of a directional light the cosine of its disc's radius */    \
  F(uint, first_map)  /* of its shadow maps, among those of an image */                          \
  F(uint, maps)       /* 0: it has none */                                                        \
  F(vec4, q)          /* of a light at rest: to world, x, y, z, w */                              \
  F(vec3, p_m)        /* in the entity frame */                                                   \
  F(uint, first_zone) /* of a surface, in real-time mode */
RTSTDB_STRUCT(LightRecord)

// Shadow maps: of a directional light concentric squares around the camera, each within the next; of a spot
// one view along its axis, or, if it is wide, as of a point light, the six faces of a cube.
RTSTDB_CONSTANT(shadow_squares, 4)
RTSTDB_CONSTANT(shadow_faces, 6)

// A triangle of a surface that emits light, in the entity frame, in the order of its mesh. The front of a
// closed body is outside. `below`: the share of the mesh's area in the triangles before it; `share`: in it.
#define RTSTDB_FIELDS_EmitterTriangle(F)                                                         \
  F(vec3, a_m)                                                                                   \
  F(float, below)                                                                                \
  F(vec3, b_m)                                                                                   \
  F(float, share)                                                                                \
  F(vec3, c_m)                                                                                   \
  F(float, unused)
RTSTDB_STRUCT(EmitterTriangle)

// Real-time mode: a part of a surface that emits light, in the axes of its entity and scaled. Spreads are
// covariances, weighted by area: xx, yy, zz; and xy, yz, zx.
#define RTSTDB_FIELDS_EmitterZone(F)                                                            \
  F(vec3, center_m)                                                                              \
  F(float, area_m2)                                                                              \
  F(vec3, n) /* the mean of the normals; its length is 1 where the zone is flat */              \
  F(vec3, n_squares)                                                                             \
  F(vec3, n_products)                                                                            \
  F(vec3, extent_squares_m2)                                                                     \
  F(vec3, extent_products_m2)                                                                    \
  F(vec3, n_extent_squares_m) /* covariances of normal and position, this and the next */        \
  F(vec3, n_extent_products_m)
RTSTDB_STRUCT(EmitterZone)

// Points of the surface in a zone, to one of which its shadow ray leads: in its middle, and toward its
// borders.
RTSTDB_CONSTANT(points_per_zone, 5)
#define RTSTDB_FIELDS_EmitterPoint(F) F(vec3, p_m) F(vec3, n)
RTSTDB_STRUCT(EmitterPoint)

// Real-time mode: what a rough surface scatters comes from two lobes, each searched with rays.
RTSTDB_CONSTANT(lobe_matt, 0)
RTSTDB_CONSTANT(lobe_mirror, 1)
RTSTDB_CONSTANT(lobes, 2)

// Share of light that a rough mirror reflects, by the cosine of the angle of incidence (x) and the roughness
// (y): image_albedo_side samples each from 0 to 1. See rtstdb/query/image/specular_albedo.hpp.
RTSTDB_CONSTANT(image_albedo_side, 32)

#define RTSTDB_FIELDS_ImageArgs(F)                                                               \
  F(uint, first) /* see place_of_invocation */                                                   \
  F(uint, end)                                                                                   \
  F(uint, per_group)                                                                             \
  F(uvec2, halt) /* this and the next as in RayArgs */                                           \
  F(uint, halt_from)                                                                             \
  F(uint, loop_probe)                                                                            \
  F(uint, epoch_ns)   /* as in RayArgs */                                                        \
  F(uint, late_base)                                                                             \
  F(uint, width)                                                                                 \
  F(uint, height)                                                                                \
  F(uint, first_tile) /* of the group, counted over all images */                                \
  F(uint, read_from)  /* where the states begin that this stage reads */                         \
  F(uint, write_from)                                                                            \
  F(uint, sample_index)                                                                          \
  F(uint, samples)                                                                               \
  F(uint, last_bounce)                                                                           \
  F(uint, skies)        /* lights are skies, then directional, then others, then surfaces */     \
  F(uint, suns_end)                                                                              \
  F(uint, emitters_from)                                                                         \
  F(uint, lights)                                                                                \
  F(uint, mapped_end) /* lights from args.skies to here have shadow maps */                      \
  F(uint, maps)       /* of an image */                                                          \
  F(uint, map_side)                                                                              \
  F(uint, image) /* image_visible.comp, image_reach.comp */                                      \
  F(uint, light) /* image_light.comp: which middle or zone; image_visible.comp: which light */ \
  F(uint, face)  /* image_visible.comp: which map of the light */                                \
  F(uint, lobe) /* image_lobe.comp, image_gather.comp; this and the next */                      \
  F(uint, ray)                                                                                   \
  F(uint, lobe_rays) /* 0: no lobe is searched */                                                \
  F(uint, zones_per_emitter) /* image_light.comp */
RTSTDB_STRUCT(ImageArgs)

#endif
