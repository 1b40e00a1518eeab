#include "runtime/run/parts_mesh.hpp"

#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <rtstdb/entity.hpp>

namespace hil::run {
namespace {

using rtstdb::TriangleMesh;

glm::dvec3 on_circle(std::uint32_t i, std::uint32_t count, double radius_m, double z_m) {
  const double angle = 2.0 * std::numbers::pi * i / count;
  return {radius_m * std::cos(angle), radius_m * std::sin(angle), z_m};
}

TriangleMesh make_cone(const config::ConePart& cone) {
  const bool has_tip = cone.top_radius_m <= 0.0;
  const double top_m = 0.5 * cone.height_m;
  const std::uint32_t n = cone.segments;
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < n; ++i)
    mesh.positions_m.emplace_back(on_circle(i, n, cone.radius_m, -top_m));
  const auto top_rim = static_cast<std::uint32_t>(mesh.positions_m.size());
  if (!has_tip) {
    for (std::uint32_t i = 0; i < n; ++i)
      mesh.positions_m.emplace_back(on_circle(i, n, cone.top_radius_m, top_m));
  }
  const auto bottom = static_cast<std::uint32_t>(mesh.positions_m.size());
  const std::uint32_t top = bottom + 1;
  mesh.positions_m.emplace_back(glm::dvec3(0.0, 0.0, -top_m));
  mesh.positions_m.emplace_back(glm::dvec3(0.0, 0.0, top_m));
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t next = (i + 1) % n;
    mesh.triangles.emplace_back(bottom, next, i);
    if (has_tip) {
      mesh.triangles.emplace_back(i, next, top);
      continue;
    }
    mesh.triangles.emplace_back(i, next, top_rim + next);
    mesh.triangles.emplace_back(i, top_rim + next, top_rim + i);
    mesh.triangles.emplace_back(top, top_rim + i, top_rim + next);
  }
  return mesh;
}

TriangleMesh make_ring(const config::RingPart& ring) {
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < ring.segments; ++i) {
    for (std::uint32_t k = 0; k < ring.sides; ++k) {
      const double angle = 2.0 * std::numbers::pi * k / ring.sides;
      mesh.positions_m.emplace_back(on_circle(i, ring.segments,
                                              ring.radius_m + ring.tube_radius_m * std::cos(angle),
                                              ring.tube_radius_m * std::sin(angle)));
    }
  }
  const auto corner = [&](std::uint32_t i, std::uint32_t k) {
    return i % ring.segments * ring.sides + k % ring.sides;
  };
  for (std::uint32_t i = 0; i < ring.segments; ++i) {
    for (std::uint32_t k = 0; k < ring.sides; ++k) {
      mesh.triangles.emplace_back(corner(i, k), corner(i + 1, k), corner(i + 1, k + 1));
      mesh.triangles.emplace_back(corner(i, k), corner(i + 1, k + 1), corner(i, k + 1));
    }
  }
  return mesh;
}

TriangleMesh mesh_of_body(const config::PartBody& body) {
  if (const auto* box = std::get_if<config::BoxPart>(&body))
    return rtstdb::make_box({box->size_m[0], box->size_m[1], box->size_m[2]});
  if (const auto* cone = std::get_if<config::ConePart>(&body)) return make_cone(*cone);
  if (const auto* sphere = std::get_if<config::SpherePart>(&body))
    return rtstdb::make_sphere(sphere->radius_m, sphere->subdivisions);
  return make_ring(std::get<config::RingPart>(body));
}

/// The copies that `repeat` makes of each pose.
std::vector<rtstdb::Pose> repeated(const std::vector<rtstdb::Pose>& poses, const config::PartRepeat& repeat) {
  glm::dvec3 axis(0.0);
  axis[static_cast<int>(repeat.axis)] = 1.0;
  const glm::dquat turn = glm::angleAxis(repeat.turn_rad, axis);
  const glm::dvec3 step_m(repeat.step_m[0], repeat.step_m[1], repeat.step_m[2]);
  std::vector<rtstdb::Pose> copies;
  copies.reserve(poses.size() * repeat.count);
  for (rtstdb::Pose pose : poses) {
    for (std::uint32_t i = 0; i < repeat.count; ++i) {
      copies.push_back(pose);
      pose = {.p_world_m = turn * pose.p_world_m + step_m, .q_world = turn * pose.q_world};
    }
  }
  return copies;
}

void append(TriangleMesh& mesh, const TriangleMesh& body, const rtstdb::Pose& pose, const glm::vec3& color) {
  const auto first = static_cast<glm::uint>(mesh.positions_m.size());
  for (const glm::vec3& p : body.positions_m)
    mesh.positions_m.emplace_back(pose.p_world_m + pose.q_world * glm::dvec3(p));
  for (const glm::uvec3& t : body.triangles)
    mesh.triangles.push_back(t + glm::uvec3(first));
  mesh.corner_colors.resize(mesh.triangles.size(), {color, color, color});
}

}  // namespace

TriangleMesh mesh_of_parts(std::span<const config::Part> parts) {
  TriangleMesh mesh;
  for (const config::Part& part : parts) {
    const auto& q = part.rotation_wxyz;
    std::vector<rtstdb::Pose> poses{
        {.p_world_m = {part.position_m[0], part.position_m[1], part.position_m[2]},
         .q_world = glm::dquat(q[0], q[1], q[2], q[3])}};
    for (const config::PartRepeat& repeat : part.repeat)
      poses = repeated(poses, repeat);
    const TriangleMesh body = mesh_of_body(part.body);
    for (const rtstdb::Pose& pose : poses)
      append(mesh, body, pose, glm::vec3(part.color[0], part.color[1], part.color[2]));
  }
  if (std::ranges::all_of(parts, [](const config::Part& part) { return part.color == config::Part{}.color; }))
    mesh.corner_colors.clear();
  return mesh;
}

}  // namespace hil::run
