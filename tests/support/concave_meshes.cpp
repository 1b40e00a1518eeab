#include "tests/support/concave_meshes.hpp"

#include <glm/ext/vector_double2.hpp>

#include <cmath>
#include <numbers>
#include <vector>

namespace rtstdb::test {
namespace {

constexpr double full_turn_rad = 2.0 * std::numbers::pi;

void append_mesh(TriangleMesh& mesh, const TriangleMesh& part, const glm::vec3& at_m, bool turns_fronts) {
  const auto first = static_cast<std::uint32_t>(mesh.positions_m.size());
  for (const glm::vec3& p : part.positions_m)
    mesh.positions_m.push_back(p + at_m);
  for (const glm::uvec3& t : part.triangles)
    mesh.triangles.push_back(first + (turns_fronts ? glm::uvec3(t.x, t.z, t.y) : t));
}

void add_quad(TriangleMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  mesh.triangles.emplace_back(a, b, c);
  mesh.triangles.emplace_back(a, c, d);
}

/// Turns a profile of points (distance from the z axis, z) around the axis. The profile begins and ends on
/// the axis, with the body on its left.
TriangleMesh revolve(const std::vector<glm::dvec2>& profile, std::uint32_t segments) {
  TriangleMesh mesh;
  std::vector<std::uint32_t> firsts;
  const auto on_axis = [&](std::size_t i) { return profile[i].x == 0.0; };
  for (std::size_t i = 0; i < profile.size(); ++i) {
    firsts.push_back(static_cast<std::uint32_t>(mesh.positions_m.size()));
    for (std::uint32_t k = 0; k < (on_axis(i) ? 1u : segments); ++k) {
      const double turn_rad = full_turn_rad * k / segments;
      mesh.positions_m.emplace_back(profile[i].x * std::cos(turn_rad), profile[i].x * std::sin(turn_rad),
                                    profile[i].y);
    }
  }
  for (std::size_t i = 0; i + 1 < profile.size(); ++i) {
    const std::size_t next = i + 1;
    for (std::uint32_t k = 0; k < segments; ++k) {
      const std::uint32_t k_next = (k + 1) % segments;
      if (on_axis(i))
        mesh.triangles.emplace_back(firsts[i], firsts[next] + k_next, firsts[next] + k);
      else if (on_axis(next))
        mesh.triangles.emplace_back(firsts[i] + k, firsts[i] + k_next, firsts[next]);
      else
        add_quad(mesh, firsts[i] + k, firsts[i] + k_next, firsts[next] + k_next, firsts[next] + k);
    }
  }
  return mesh;
}

}  // namespace

TriangleMesh make_torus(double ring_radius_m, double tube_radius_m, std::uint32_t segments) {
  TriangleMesh mesh;
  const double step_rad = 2.0 * std::numbers::pi / segments;
  for (std::uint32_t i = 0; i < segments; ++i) {
    for (std::uint32_t j = 0; j < segments; ++j) {
      const double out_m = ring_radius_m + tube_radius_m * std::cos(step_rad * j);
      mesh.positions_m.emplace_back(out_m * std::cos(step_rad * i), out_m * std::sin(step_rad * i),
                                    tube_radius_m * std::sin(step_rad * j));
      const std::uint32_t next_i = (i + 1) % segments;
      const std::uint32_t next_j = (j + 1) % segments;
      mesh.triangles.emplace_back(i * segments + j, next_i * segments + j, next_i * segments + next_j);
      mesh.triangles.emplace_back(i * segments + j, next_i * segments + next_j, i * segments + next_j);
    }
  }
  return mesh;
}

TriangleMesh make_bowl(double outer_radius_m, double inner_radius_m, std::uint32_t segments) {
  std::vector<glm::dvec2> profile;
  const std::uint32_t steps = segments / 4;
  const auto add_arc = [&](double radius_m, std::uint32_t step) {
    const double rise_rad = 0.25 * full_turn_rad * step / steps;
    profile.emplace_back(step == 0 ? 0.0 : radius_m * std::sin(rise_rad),
                         step == steps ? 0.0 : -radius_m * std::cos(rise_rad));
  };
  for (std::uint32_t step = 0; step <= steps; ++step)
    add_arc(outer_radius_m, step);
  for (std::uint32_t step = steps + 1; step-- > 0;)
    add_arc(inner_radius_m, step);
  return revolve(profile, segments);
}

TriangleMesh make_hollow_sphere(double outer_radius_m, double inner_radius_m, std::uint32_t subdivisions) {
  TriangleMesh mesh = make_sphere(outer_radius_m, subdivisions);
  append_mesh(mesh, make_sphere(inner_radius_m, subdivisions), glm::vec3(0.0f), true);
  return mesh;
}

TriangleMesh make_gear(double tip_radius_m, double root_radius_m, double hole_radius_m, double thickness_m,
                       std::uint32_t teeth) {
  TriangleMesh mesh;
  const std::uint32_t count = 4 * teeth;
  // Four circles of corners: the outline and the hole, above and below.
  for (const double z : {0.5 * thickness_m, -0.5 * thickness_m}) {
    for (const bool is_outline : {true, false}) {
      for (std::uint32_t i = 0; i < count; ++i) {
        const double turn_rad = full_turn_rad * i / count;
        const double radius_m = !is_outline ? hole_radius_m : i % 4 < 2 ? tip_radius_m : root_radius_m;
        mesh.positions_m.emplace_back(radius_m * std::cos(turn_rad), radius_m * std::sin(turn_rad), z);
      }
    }
  }
  const std::uint32_t hole = count;
  const std::uint32_t below = 2 * count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = (i + 1) % count;
    add_quad(mesh, i, next, hole + next, hole + i);
    add_quad(mesh, below + next, below + i, below + hole + i, below + hole + next);
    add_quad(mesh, below + i, below + next, next, i);
    add_quad(mesh, below + hole + next, below + hole + i, hole + i, hole + next);
  }
  return mesh;
}

TriangleMesh make_l_shape(double arm_m, double width_m, double depth_m) {
  TriangleMesh mesh;
  for (const double z : {depth_m, 0.0}) {
    mesh.positions_m.emplace_back(0.0, 0.0, z);
    mesh.positions_m.emplace_back(arm_m, 0.0, z);
    mesh.positions_m.emplace_back(arm_m, width_m, z);
    mesh.positions_m.emplace_back(width_m, width_m, z);
    mesh.positions_m.emplace_back(width_m, arm_m, z);
    mesh.positions_m.emplace_back(0.0, arm_m, z);
  }
  for (std::uint32_t i = 1; i < 5; ++i) {
    mesh.triangles.emplace_back(0, i, i + 1);
    mesh.triangles.emplace_back(6, 6 + i + 1, 6 + i);
  }
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t next = (i + 1) % 6;
    add_quad(mesh, 6 + i, 6 + next, next, i);
  }
  return mesh;
}

TriangleMesh make_fingers(std::uint32_t count, double radius_m, double length_m, double spacing_m,
                          std::uint32_t segments) {
  TriangleMesh mesh;
  const TriangleMesh finger = make_cylinder(radius_m, length_m, segments);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double x_m = spacing_m * (i - 0.5 * (count - 1.0));
    append_mesh(mesh, finger, glm::vec3(static_cast<float>(x_m), 0.0f, 0.0f), false);
  }
  return mesh;
}

TriangleMesh make_wavy_sheet(double size_m, double height_m, std::uint32_t cells) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i <= cells; ++i) {
    for (std::uint32_t k = 0; k <= cells; ++k) {
      const double u = static_cast<double>(i) / cells;
      const double v = static_cast<double>(k) / cells;
      mesh.positions_m.emplace_back(size_m * (u - 0.5), size_m * (v - 0.5),
                                    height_m * std::sin(full_turn_rad * u) * std::cos(full_turn_rad * v));
    }
  }
  for (std::uint32_t i = 0; i < cells; ++i) {
    for (std::uint32_t k = 0; k < cells; ++k) {
      const std::uint32_t at = i * (cells + 1) + k;
      add_quad(mesh, at, at + cells + 1, at + cells + 2, at + 1);
    }
  }
  return mesh;
}

}  // namespace rtstdb::test
