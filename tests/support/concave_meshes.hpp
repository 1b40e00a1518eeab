#pragma once
// Meshes of bodies that are not convex. All but the sheet are closed, with their fronts outside.

#include <glm/ext/vector_float3.hpp>

#include <cstdint>

#include <rtstdb/geometry.hpp>

namespace rtstdb::test {

/// Around the z axis. 2 * segments^2 triangles.
TriangleMesh make_torus(double ring_radius_m, double tube_radius_m, std::uint32_t segments);
/// The lower half of a thick hollow sphere around the origin, with its opening toward +z.
TriangleMesh make_bowl(double outer_radius_m, double inner_radius_m, std::uint32_t segments);
/// A hollow sphere: an outer surface, and an inner one whose front is toward the centre.
TriangleMesh make_hollow_sphere(double outer_radius_m, double inner_radius_m, std::uint32_t subdivisions);
/// A disk with teeth around the z axis, and a round hole. 32 triangles for each tooth.
TriangleMesh make_gear(double tip_radius_m, double root_radius_m, double hole_radius_m, double thickness_m,
                       std::uint32_t teeth);
/// Two arms along the x and y axes from the origin's corner, which are arm_m long and width_m wide, from
/// z = 0 to depth_m.
TriangleMesh make_l_shape(double arm_m, double width_m, double depth_m);
/// Parallel cylinders along z, side by side along x, as one mesh. Each is a convex part.
TriangleMesh make_fingers(std::uint32_t count, double radius_m, double length_m, double spacing_m,
                          std::uint32_t segments);
/// A square sheet that waves along x and y, with its front toward +z. Not closed. 2 * cells^2 triangles.
TriangleMesh make_wavy_sheet(double size_m, double height_m, std::uint32_t cells);

}  // namespace rtstdb::test
