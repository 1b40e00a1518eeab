#pragma once
// Triangle geometry: from files, from procedural shapes, or from the caller. Entities move. The geometry of
// an entity does not change, unless it was added as deforming: then Transaction::update_geometry moves its
// positions.
//
// Threads: all functions are pure except load_mesh, which reads files; any thread. They allocate: not for the
// tick.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/field.hpp>
#include <rtstdb/result.hpp>
#include <rtstdb/solid.hpp>

namespace rtstdb {

/// One value for each corner of a triangle, in the order of its indices.
using CornerValues = std::array<glm::vec3, 3>;

/// Entity frame, metres. Seen from its front, the corners of a triangle are in counter-clockwise order.
struct TriangleMesh {
  std::vector<glm::vec3> positions_m{};
  std::vector<glm::uvec3> triangles{};
  /// Shading normals for images, entity frame; no other query reads them. Empty, or one entry for each
  /// triangle. Any length but zero; those of load_mesh have length 1.
  std::vector<CornerValues> corner_normals{};
  /// Colours for images, by which the base colour of the entity's material is multiplied: red, green and blue
  /// in linear light with the primaries of sRGB, 0 to 1. Empty (all white), or one entry for each triangle.
  std::vector<CornerValues> corner_colors{};
};

/// Axis-aligned box, metres.
struct Bounds {
  glm::vec3 minimum_m{0.0f};
  glm::vec3 maximum_m{0.0f};
};

/// The corners of convex parts, entity frame, metres: each part is the convex hull of its points.
using ConvexPartPoints = std::vector<std::vector<glm::vec3>>;

struct GeometryOptions {
  /// Its positions may change; its triangles stay. Its corner normals are discarded, since they would not
  /// fit another shape; its corner colours stay. It takes about 200 bytes for each triangle on the device;
  /// other geometry takes 56. Corner normals, colours or both take 32 bytes more.
  bool deforms = false;
  /// Deforming geometry: number of shapes kept for queries at older versions, the newest included. A shape
  /// takes 12 bytes for each position on the host. 1 to max_retained_shapes.
  std::uint32_t retained_shapes = 2;
  /// Deforming geometry: when the tree is rebuilt. A new shape refits the boxes of the existing tree. If the
  /// cost of the tree by the surface area heuristic, relative to the cost of its triangles alone, has grown
  /// by more than this factor since the tree was built, it is rebuilt at once, which takes about ten times as
  /// long as a refit. At least 1; infinity: never.
  float rebuild_growth = 1.5f;
  /// Geometry that does not deform: also build a distance field, for cone queries in ConeMode::fast. The log
  /// does not hold it: see Database::build_field for geometry that was recovered.
  std::optional<FieldOptions> field{};
  /// Geometry that does not deform: the convex parts of its body, for instance from V-HACD or CoACD. In a
  /// pair with another body that has convex parts, contacts and impacts are those of the parts, and a contact
  /// point names the nearest triangle of the mesh. In a pair with a body that has none, they are those of the
  /// mesh (contact.hpp). Empty: the parts that the mesh consists of, if it does (GeometryInfo::convex_parts).
  /// In the log. Errors: bad_input for geometry that deforms, for more than max_convex_parts parts, for a
  /// part of more than max_convex_part_points points or whose points have no hull (make_hull), for a point of
  /// a part's surface that is farther outside the mesh than convex_parts_tolerance
  /// (limits.hpp) times the diagonal of the mesh's box, and for a point of the mesh that is farther outside
  /// all parts. Tested are all corners, and points of both surfaces that are half that length apart, without
  /// those of a part that lie inside another part.
  ConvexPartPoints convex_parts_m{};
  /// Geometry that does not deform: the exact shape of its body, which the mesh approximates. In the log.
  /// Errors: bad_input for geometry that deforms, a size that is not finite and positive, a rotation that is
  /// not of length 1, convex parts beside it, and if a point of the mesh is farther from the solid's surface,
  /// or a point of the solid's surface farther from the mesh, than solid_tolerance (limits.hpp) times the
  /// diagonal of the mesh's box. Tested are the corners and the middles of edges and triangles, and 256
  /// points of the solid.
  std::optional<Solid> solid{};
};

/// Properties of a geometry in a database.
struct GeometryInfo {
  std::string name{};
  std::uint32_t triangles = 0;
  bool deforms = false;
  bool closed = false;  ///< each edge of its triangles is passed as often in one direction as in the other
  /// It has one convex part: its mesh is closed, and every point of its surface is near the surface of the
  /// hull of its corners, up to convex_tolerance (limits.hpp) times the diagonal of its box, or up to
  /// hull_tolerance_ulp; or it has a solid, or one part in GeometryOptions::convex_parts_m. Geometry that
  /// deforms counts as not convex.
  bool convex = false;
  bool solid = false;  ///< it has GeometryOptions::solid
  /// 1 for a solid, or those of GeometryOptions::convex_parts_m. Without them, 1 for a convex geometry;
  /// another one consists of convex parts if each piece of its mesh (triangles that share corners by index)
  /// is convex, up to max_convex_parts of them. 0: contact and impact queries search its triangles.
  std::uint32_t convex_parts = 0;
  /// Corners and faces of the hulls of all parts, without corners inside faces or edges up to half of
  /// hull_tolerance_ulp. For a solid with a curved surface: the corners of its core, and the polygons that
  /// stand for its flat faces.
  std::uint32_t hull_corners = 0, hull_faces = 0;
};

/// Checks that a mesh can be added. Triangles without area (in double precision) are allowed beside others;
/// no ray hits them.
/// Errors: bad_input for a mesh without triangles, an index beyond the positions, a coordinate that is not
/// finite or beyond max_coordinate_m, corner normals or colours whose number is neither 0 nor that of the
/// triangles, a corner normal that is not finite or of length zero, a corner colour outside 0 to 1, and a
/// mesh whose triangles all have no area; capacity for more than max_triangles_total triangles. The message
/// names the triangle and its values.
Result<void> validate(const TriangleMesh& mesh);

/// Checks the mesh, and that it fits the options' solid and convex parts. Errors: those of validate of the
/// mesh, and of GeometryOptions::solid and convex_parts_m where they do not fit the mesh. Combinations of
/// options are not checked: add_geometry does that.
Result<void> validate(const TriangleMesh& mesh, const GeometryOptions& options);

/// Bounds of the positions that triangles use, exact. Misuse: a mesh without triangles.
Bounds bounds_of(const TriangleMesh& mesh);

/// Content of a file that load_mesh left out.
struct MeshFileReport {
  bool materials_ignored = false;  ///< also those that an OBJ file takes from another file
  bool textures_ignored = false;   ///< or texture coordinates for them
};

/// Reads OBJ, STL (text and binary), PLY, glTF 2 or GLB 2; the file's extension says which. All meshes of the
/// file are merged into one. Node transforms are applied (a mirroring one keeps fronts outside). Polygons of
/// up to max_polygon_corners corners are triangulated. Points, lines, materials and textures are ignored.
/// Corners are neither merged nor sorted; axes are those of the file. `scale` multiplies coordinates (files
/// in millimetres: 0.001); it must be positive. `report`: null, or where to say what was left out of a mesh
/// that was read.
///
/// Corner normals and colours are those of the vertices (in OBJ files, normals of the corners of faces). If
/// any corner of a file has a normal other than zero, each corner without one gets the normal of its triangle
/// (of a triangle without area: +z). If any corner has a colour, each corner without one is white.
///   OBJ   `vn`, and colours `v x y z r g b` in sRGB, 0 to 1; a seventh number is ignored
///   PLY   vertex properties nx, ny, nz, and red, green, blue in sRGB: uchar, ushort, or 0 to 1 as float or
///         double; colours of faces are ignored
///   glTF  NORMAL, and COLOR_0, which is linear; values outside 0 to 1 are clamped, and alpha is ignored
///   STL   none; the normals of facets are ignored
///
/// Errors: file, with the path, the place and the fault. Among the faults are a face of fewer than three
/// corners, an index beyond the positions, an STL file whose count contradicts its size, data after the last
/// element of a PLY file, and in glTF: a required extension that changes geometry, a primitive without
/// positions, positions that are not floats, sparse accessors, a node with two parents, a transform with too
/// few or too many numbers, normals or colours of another type or number than positions, and JSON nested
/// more than 100 levels deep (nodes may nest as deep as the file has nodes). In OBJ and PLY: a normal or
/// colour with too few numbers, one that is not finite, a colour outside its range, and an index beyond the
/// normals. Then the errors of validate, with the path.
Result<TriangleMesh> load_mesh(const std::filesystem::path& path, double scale = 1.0,
                               MeshFileReport* report = nullptr);

/// The corners of the pieces of a mesh, which are triangles that share corners by index: what a file of a
/// convex decomposition holds (OBJ, PLY, glTF; in STL files no triangles share corners). In the order of the
/// pieces' first triangles, each corner once.
ConvexPartPoints pieces_of(const TriangleMesh& mesh);

/// Shapes, centred on the origin but for the hull. All but the rectangle are closed, with their fronts
/// outside. Misuse: a size that is not finite and positive, and counts outside their range.
/// A box with these edge lengths.
TriangleMesh make_box(const glm::dvec3& size_m);
/// A prism whose corners lie on the cylinder; its axis is z. 4 * segments triangles; segments from 3 to
/// max_triangles_total / 4.
TriangleMesh make_cylinder(double radius_m, double height_m, std::uint32_t segments = 32);
/// A subdivided icosahedron whose corners lie on the sphere. 20 * 4^subdivisions triangles; at most 10
/// subdivisions.
TriangleMesh make_sphere(double radius_m, std::uint32_t subdivisions = 3);
/// The convex hull of a set of points in any order, with repetitions or not. Its positions are the n corners
/// of the hull, where they are, in the order of the points: none lies inside a face or an edge. At most 2n -
/// 4 triangles; none has a corner in front of it or is without an area, exactly and not up to rounding. Time:
/// usually in proportion to the number of points times its logarithm.
/// Errors: bad_input for a coordinate that is not finite, for fewer than four points, and for a set that is
/// thinner than hull_tolerance_ulp (limits.hpp): its thickness is the least extent along the normal of a
/// triangle of the hull, which is one to three times the least extent along any direction.
Result<TriangleMesh> make_hull(std::span<const glm::vec3> points_m);
/// Two triangles in the plane z = 0, with their front toward +z.
TriangleMesh make_rectangle(double size_x_m, double size_y_m);

}  // namespace rtstdb
