#include "runtime/run/scenery.hpp"

#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

#include "runtime/modules/module.hpp"

namespace hil::run {
namespace {

rtstdb::TriangleMesh mesh_of(const config::WorldEntity& entity) {
  const config::Shape& shape = entity.shape;
  if (const auto* box = std::get_if<config::BoxShape>(&shape)) {
    return rtstdb::make_box({box->size_m[0], box->size_m[1], box->size_m[2]});
  }
  if (const auto* cylinder = std::get_if<config::CylinderShape>(&shape)) {
    return rtstdb::make_cylinder(cylinder->radius_m, cylinder->height_m);
  }
  if (const auto* sphere = std::get_if<config::SphereShape>(&shape))
    return rtstdb::make_sphere(sphere->radius_m);
  if (const auto* rectangle = std::get_if<config::RectangleShape>(&shape)) {
    return rtstdb::make_rectangle(rectangle->size_m[0], rectangle->size_m[1]);
  }
  const auto& file = std::get<config::FileShape>(shape);
  auto mesh = rtstdb::load_mesh(file.path, file.scale);
  if (!mesh) throw modules::SetupError("entity '" + entity.name.text + "': " + mesh.error().message);
  return std::move(mesh).value();
}

rtstdb::Motion motion_of(const config::WorldEntity& entity) {
  const auto vector = [](const std::array<double, 3>& v) { return glm::dvec3(v[0], v[1], v[2]); };
  return {.p_world_m = vector(entity.position_m),
          .q_world = glm::dquat(entity.rotation_wxyz[0], entity.rotation_wxyz[1], entity.rotation_wxyz[2],
                                entity.rotation_wxyz[3]),
          .v_world_mps = vector(entity.velocity_mps),
          .w_world_radps = vector(entity.angular_velocity_radps),
          .valid_from = {}};
}

/// Which colour an entity gets in the top view: by the name of its first layer, as the report's layers are
/// called.
report::Layer report_layer(const config::WorldEntity& entity) {
  if (entity.mask.empty()) return report::Layer::structure;
  return report::layer_from(entity.mask.front().text).value_or(report::Layer::structure);
}

std::vector<report::PointM> circle(double radius_m) {
  constexpr int corners = 24;
  std::vector<report::PointM> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * glm::pi<double>() * i / corners;
    points.push_back({radius_m * std::cos(angle), radius_m * std::sin(angle)});
  }
  return points;
}

std::vector<report::PointM> rectangle(double x0, double y0, double x1, double y1) {
  return {{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}};
}

/// In the entity frame, seen along z; a mesh by its box.
std::vector<report::PointM> footprint(const config::WorldEntity& entity) {
  const config::Shape& shape = entity.shape;
  if (const auto* cylinder = std::get_if<config::CylinderShape>(&shape)) return circle(cylinder->radius_m);
  if (const auto* sphere = std::get_if<config::SphereShape>(&shape)) return circle(sphere->radius_m);
  const rtstdb::Bounds bounds = rtstdb::bounds_of(mesh_of(entity));
  return rectangle(bounds.minimum_m.x, bounds.minimum_m.y, bounds.maximum_m.x, bounds.maximum_m.y);
}

}  // namespace

void create_scenery(const config::Scenario& scenario, modules::World& world) {
  for (const config::WorldEntity& entity : scenario.world.entities) {
    rtstdb::EntityRow row;
    row.geometry = world.add_geometry(mesh_of(entity), entity.name.text);
    row.scale = glm::dvec3(entity.scale);
    row.mask = entity.mask_bits;
    row.motion = motion_of(entity);
    world.create(entity.name.text, row);
  }
}

std::vector<report::Shape> outlines(const config::Scenario& scenario) {
  std::vector<report::Shape> shapes;
  for (const config::WorldEntity& entity : scenario.world.entities) {
    report::Shape shape{
        .layer = report_layer(entity), .label = entity.name.text, .footprint = footprint(entity)};
    const rtstdb::Motion motion = motion_of(entity);
    for (report::PointM& point : shape.footprint) {
      const glm::dvec3 p =
          motion.p_world_m + motion.q_world * (entity.scale * glm::dvec3(point.x_m, point.y_m, 0.0));
      point = {p.x, p.y};
    }
    shapes.push_back(std::move(shape));
  }
  return shapes;
}

}  // namespace hil::run
