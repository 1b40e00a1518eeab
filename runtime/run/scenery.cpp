#include "runtime/run/scenery.hpp"

#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <map>
#include <optional>
#include <tuple>

#include <rtstdb/limits.hpp>

#include "runtime/config/numbers.hpp"
#include "runtime/config/world_limits.hpp"
#include "runtime/modules/module.hpp"

namespace hil::run {
namespace {

static_assert(config::farthest_m == rtstdb::max_coordinate_m);
static_assert(config::fastest_mps == rtstdb::max_speed_mps);
static_assert(config::fastest_turn_radps == rtstdb::max_angular_rate_radps);
static_assert(config::smallest_scale == rtstdb::min_scale && config::largest_scale == rtstdb::max_scale);

/// Equal for equal shapes: the kind, its sizes, and the path of a file.
using ShapeKey = std::tuple<std::size_t, std::array<double, 3>, std::string>;

ShapeKey key_of(const config::Shape& shape) {
  std::array<double, 3> sizes{};
  std::string path;
  if (const auto* box = std::get_if<config::BoxShape>(&shape)) {
    sizes = box->size_m;
  } else if (const auto* cylinder = std::get_if<config::CylinderShape>(&shape)) {
    sizes = {cylinder->radius_m, cylinder->height_m};
  } else if (const auto* sphere = std::get_if<config::SphereShape>(&shape)) {
    sizes = {sphere->radius_m};
  } else if (const auto* rectangle = std::get_if<config::RectangleShape>(&shape)) {
    sizes = {rectangle->size_m[0], rectangle->size_m[1]};
  } else {
    const auto& file = std::get<config::FileShape>(shape);
    sizes = {file.scale};
    path = file.path;
  }
  return {shape.index(), sizes, std::move(path)};
}

/// Empty with a mistake when a file can not be used.
std::optional<rtstdb::TriangleMesh> mesh_of(const config::Shape& shape, config::Diagnostics& diagnostics) {
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
  if (mesh) return std::move(mesh).value();
  diagnostics.add(file.place, mesh.error().message);
  return std::nullopt;
}

/// Words of the scenario are checked where they are read; what a file holds is known only now.
void check_scale(const config::WorldEntity& entity, const rtstdb::Bounds& bounds,
                 config::Diagnostics& diagnostics) {
  if (!std::holds_alternative<config::FileShape>(entity.shape)) return;
  const glm::vec3 corner = glm::max(glm::abs(bounds.minimum_m), glm::abs(bounds.maximum_m));
  const double farthest_m = entity.scale * static_cast<double>(std::max({corner.x, corner.y, corner.z}));
  if (farthest_m <= rtstdb::max_coordinate_m) return;
  diagnostics.add(entity.scale_place,
                  "'scale' takes a corner of the mesh to " + config::format_number(farthest_m) + " m; " +
                      config::format_number(rtstdb::max_coordinate_m) + " m is the farthest");
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
std::vector<report::PointM> footprint(const config::Shape& shape, const rtstdb::Bounds& bounds) {
  if (const auto* cylinder = std::get_if<config::CylinderShape>(&shape)) return circle(cylinder->radius_m);
  if (const auto* sphere = std::get_if<config::SphereShape>(&shape)) return circle(sphere->radius_m);
  return rectangle(bounds.minimum_m.x, bounds.minimum_m.y, bounds.maximum_m.x, bounds.maximum_m.y);
}

}  // namespace

Scenery make_scenery(const config::World& world, config::Diagnostics& diagnostics) {
  Scenery scenery;
  std::map<ShapeKey, std::optional<std::size_t>> known;  // empty: can not be made, and that has been said
  for (const config::WorldEntity& entity : world.entities) {
    const auto [at, is_new] = known.try_emplace(key_of(entity.shape));
    if (is_new) {
      if (auto mesh = mesh_of(entity.shape, diagnostics)) {
        at->second = scenery.meshes.size();
        scenery.bounds.push_back(rtstdb::bounds_of(*mesh));
        scenery.meshes.push_back(std::move(*mesh));
        scenery.of.push_back(&entity);
      }
    }
    if (at->second) check_scale(entity, scenery.bounds[*at->second], diagnostics);
    scenery.mesh_of.push_back(at->second.value_or(0));
  }
  return scenery;
}

void create_scenery(const config::Scenario& scenario, Scenery& scenery, modules::World& world) {
  std::vector<rtstdb::GeometryId> geometries;
  for (std::size_t i = 0; i < scenery.meshes.size(); ++i) {
    geometries.push_back(world.add_geometry(scenery.meshes[i], scenery.of[i]->name.text));
    scenery.meshes[i] = {};
  }
  for (std::size_t i = 0; i < scenario.world.entities.size(); ++i) {
    const config::WorldEntity& entity = scenario.world.entities[i];
    rtstdb::EntityRow row;
    row.geometry = geometries[scenery.mesh_of[i]];
    row.scale = glm::dvec3(entity.scale);
    row.mask = entity.mask_bits;
    row.motion = motion_of(entity);
    world.create(entity.name.text, row);
  }
}

std::vector<report::Shape> outlines(const config::Scenario& scenario, const Scenery& scenery) {
  std::vector<report::Shape> shapes;
  for (std::size_t i = 0; i < scenario.world.entities.size(); ++i) {
    const config::WorldEntity& entity = scenario.world.entities[i];
    report::Shape shape{.layer = report_layer(entity),
                        .label = entity.name.text,
                        .footprint = footprint(entity.shape, scenery.bounds[scenery.mesh_of[i]])};
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
