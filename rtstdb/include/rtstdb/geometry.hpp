#pragma once
// Triangle geometry: from files, from procedural shapes, or from the caller. Entities move; a geometry stays as
// it is, unless it was added as one that deforms: then its corners move by Transaction::update_geometry.

#include <glm/ext/vector_double3.hpp>
#include <glm/ext/vector_float3.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <cstdint>
#include <filesystem>
#include <vector>

#include <rtstdb/result.hpp>

namespace rtstdb {

/// Entity frame, metres. A triangle's front is the side from which its corners run counter-clockwise.
struct TriangleMesh {
  std::vector<glm::vec3> positions_m{};
  std::vector<glm::uvec3> triangles{};
};

struct Bounds {
  glm::vec3 minimum_m{0.0f};
  glm::vec3 maximum_m{0.0f};
};

struct GeometryOptions {
  /// Its corners may move, its triangles stay. It takes about 200 bytes a triangle on the device, where one that stays
  /// takes 56.
  bool deforms = false;
  /// How many shapes are kept, the newest among them, for queries that read older versions; one is 12 bytes a
  /// position on the host. 1 to max_kept_shapes. For deforming ones, as all below.
  std::uint32_t kept_shapes = 2;
  /// The tree over its triangles stays while boxes are made anew. Where what it costs a ray, by the surface area
  /// heuristic and beside what its triangles cost by themselves, has grown by more than this factor since it was
  /// built, another one is built at once, which takes about ten times as long. At least 1; infinity: never.
  float rebuild_growth = 1.5f;
};

/// Refuses: no triangle, an index past the positions, NaN or infinite coordinates, coordinates beyond
/// limits.hpp, a mesh whose triangles are all degenerate (bad_input); more than max_triangles_total triangles
/// (capacity). The error names the triangle and its values. Single degenerate triangles (no area in double
/// precision) among good ones are allowed: no ray ever hits them.
Result<void> validate(const TriangleMesh& mesh);

/// Box of all positions used by triangles, exact. The mesh has passed validate (misuse asserts).
Bounds bounds_of(const TriangleMesh& mesh);

/// Reads OBJ, STL (text and binary), PLY, glTF 2 or GLB 2, told apart by the extension. All meshes of the file
/// become one: node transforms applied (a mirroring one keeps fronts outside), polygons of up to
/// max_polygon_corners triangulated, points, lines, materials and textures left out, corners neither welded
/// nor sorted, axes as the file has them. `scale` multiplies coordinates (files in millimetres: 0.001) and
/// must be positive. Errors: ErrorCode::file with the path, the place and the fault, among them a face of
/// fewer than three corners, an index beyond the positions, an STL file whose count contradicts its size, data
/// behind the last element of a PLY file, and in glTF a required extension that changes geometry, a primitive
/// without positions, positions that are not floats, sparse accessors, a node with two parents, a transform
/// with too few or too many numbers, and JSON that nests more than 100 levels deep (nodes may nest as deep as
/// the file has nodes); then the errors of validate, with the path.
Result<TriangleMesh> load_mesh(const std::filesystem::path& path, double scale = 1.0);

/// Closed surfaces with outward fronts, centred on the origin. Sizes are full extents in metres, finite and
/// positive (misuse asserts).
TriangleMesh make_box(const glm::dvec3& size_m);
/// The prism whose corners lie on the cylinder; axis along z. 4 * segments triangles, segments >= 3.
TriangleMesh make_cylinder(double radius_m, double height_m, std::uint32_t segments = 32);
/// A subdivided icosahedron, 20 * 4^subdivisions triangles; corners lie on the sphere; subdivisions <= 10.
TriangleMesh make_sphere(double radius_m, std::uint32_t subdivisions = 3);
/// An open rectangle in z = 0, front up.
TriangleMesh make_rectangle(double size_x_m, double size_y_m);

}  // namespace rtstdb
