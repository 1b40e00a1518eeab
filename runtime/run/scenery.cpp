#include "runtime/run/scenery.hpp"

#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include <hil/module.hpp>
#include <hil/numbers.hpp>
#include <rtstdb/limits.hpp>

#include "runtime/config/world_limits.hpp"
#include "runtime/run/parts_mesh.hpp"
#include "runtime/run/scene_optics.hpp"

namespace hil::run {
namespace {

static_assert(config::max_coordinate_m == rtstdb::max_coordinate_m);
static_assert(config::max_speed_mps == rtstdb::max_speed_mps);
static_assert(config::max_angular_rate_radps == rtstdb::max_angular_rate_radps);
static_assert(config::max_added_materials + 1 == rtstdb::max_materials);
static_assert(config::max_retro_gain == rtstdb::max_retro_gain);
static_assert(config::max_refractive_index == rtstdb::max_refractive_index);
static_assert(config::max_lights == rtstdb::max_lights);
static_assert(config::max_luminance_cdpm2 == rtstdb::max_luminance_cdpm2);
static_assert(config::max_light_color == rtstdb::max_light_color);
static_assert(config::max_illuminance_lx == rtstdb::max_illuminance_lx);
static_assert(config::max_intensity_cd == rtstdb::max_intensity_cd);
static_assert(config::max_angular_diameter_rad == rtstdb::max_angular_diameter_rad);
static_assert(config::min_spot_angle_rad == rtstdb::min_spot_angle_rad);
static_assert(config::max_spot_angle_rad == rtstdb::max_spot_angle_rad);
static_assert(config::max_field_bytes == rtstdb::max_field_bytes);
static_assert(config::min_scale == rtstdb::min_scale && config::max_scale == rtstdb::max_scale);

/// Equal for equal shapes with equal fields, convex parts and solids: the kind, its sizes, the path of a
/// file, the field, the path and the scale of the parts, and the solid.
using ShapeKey =
    std::tuple<std::size_t, std::array<double, 3>, std::string, std::optional<config::DistanceField>,
               std::string, double, std::optional<config::SolidShape>>;

ShapeKey key_of(const config::WorldEntity& entity) {
  const config::Shape& shape = entity.shape;
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
  } else if (const auto* parts = std::get_if<config::PartsShape>(&shape)) {
    path = parts->path;
  } else {
    const auto& file = std::get<config::FileShape>(shape);
    sizes = {file.scale};
    path = file.path;
  }
  const config::FileShape parts = entity.convex_parts.value_or(config::FileShape{});
  return {shape.index(), sizes, std::move(path), entity.field, parts.path, parts.scale, entity.solid};
}

/// Empty with a mistake when the file can not be used.
std::optional<rtstdb::TriangleMesh> mesh_of_parts_file(const config::PartsShape& shape,
                                                       config::Diagnostics& diagnostics) {
  const auto parts = config::load_parts(shape.path, rtstdb::max_triangles_total, diagnostics);
  if (!parts) return std::nullopt;
  rtstdb::TriangleMesh mesh = mesh_of_parts(*parts);
  const auto valid = rtstdb::validate(mesh);
  if (valid) return mesh;
  diagnostics.add(shape.place, shape.path + ": " + valid.error().message);
  return std::nullopt;
}

/// `report`: null, or what is left out of the file.
std::optional<rtstdb::TriangleMesh> mesh_of_file(const config::FileShape& file,
                                                 config::Diagnostics& diagnostics,
                                                 rtstdb::MeshFileReport* report = nullptr) {
  auto mesh = rtstdb::load_mesh(file.path, file.scale, report);
  if (mesh) return std::move(mesh).value();
  diagnostics.add(file.place, mesh.error().message);
  return std::nullopt;
}

/// Warns once per file of what is left out of it.
class SurfaceWarnings {
 public:
  void add(const config::FileShape& file, const rtstdb::MeshFileReport& report,
           config::Diagnostics& diagnostics) {
    if (!report.materials_ignored && !report.textures_ignored) return;
    if (!warned_.insert(file.path).second) return;
    const char* const what = !report.textures_ignored    ? "materials"
                             : !report.materials_ignored ? "textures"
                                                         : "materials and textures";
    diagnostics.warn(file.place, "mesh file '" + file.path + "' has " + what +
                                     ", which are ignored; 'material' gives the surface of an entity");
  }

 private:
  std::set<std::string> warned_;  // paths
};

/// Empty with a mistake when a file can not be used.
std::optional<rtstdb::TriangleMesh> mesh_of(const config::Shape& shape, SurfaceWarnings& warnings,
                                            config::Diagnostics& diagnostics) {
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
  if (const auto* parts = std::get_if<config::PartsShape>(&shape))
    return mesh_of_parts_file(*parts, diagnostics);
  const auto& file = std::get<config::FileShape>(shape);
  rtstdb::MeshFileReport report;
  auto mesh = mesh_of_file(file, diagnostics, &report);
  if (mesh) warnings.add(file, report, diagnostics);
  return mesh;
}

/// The corners of the pieces of the file; none without one, or with a mistake.
rtstdb::ConvexPartPoints convex_parts_of(const config::WorldEntity& entity,
                                         config::Diagnostics& diagnostics) {
  if (!entity.convex_parts) return {};
  const auto mesh = mesh_of_file(*entity.convex_parts, diagnostics);
  return mesh ? rtstdb::pieces_of(*mesh) : rtstdb::ConvexPartPoints{};
}

/// The scenario's 'solid'; without it the solid of a cylinder or a sphere, unless there are 'convex_parts'.
std::optional<rtstdb::Solid> solid_of(const config::WorldEntity& entity) {
  if (entity.solid) {
    const config::SolidShape& solid = *entity.solid;
    const auto vector = [](const std::array<double, 3>& v) { return glm::dvec3(v[0], v[1], v[2]); };
    rtstdb::Solid made{.kind = rtstdb::SolidKind::box,
                       .size_m = vector(solid.size_m),
                       .radius_m = solid.radius_m,
                       .height_m = solid.height_m,
                       .center_m = vector(solid.position_m),
                       .q_entity = glm::dquat(solid.rotation_wxyz[0], solid.rotation_wxyz[1],
                                              solid.rotation_wxyz[2], solid.rotation_wxyz[3])};
    using enum rtstdb::SolidKind;
    for (const rtstdb::SolidKind kind : {box, sphere, capsule, cylinder})
      if (solid.kind == rtstdb::to_string(kind)) made.kind = kind;
    return made;
  }
  if (entity.convex_parts) return std::nullopt;
  if (const auto* cylinder = std::get_if<config::CylinderShape>(&entity.shape))
    return rtstdb::Solid{
        .kind = rtstdb::SolidKind::cylinder, .radius_m = cylinder->radius_m, .height_m = cylinder->height_m};
  if (const auto* sphere = std::get_if<config::SphereShape>(&entity.shape))
    return rtstdb::Solid{.kind = rtstdb::SolidKind::sphere, .radius_m = sphere->radius_m};
  return std::nullopt;
}

/// Reads the convex parts and the solid, and adds a mistake if they do not fit the mesh.
rtstdb::GeometryOptions contact_options(const config::WorldEntity& entity, const rtstdb::TriangleMesh& mesh,
                                        config::Diagnostics& diagnostics) {
  rtstdb::GeometryOptions options;
  options.convex_parts_m = convex_parts_of(entity, diagnostics);
  options.solid = solid_of(entity);
  const auto valid = rtstdb::validate(mesh, options);
  if (valid) return options;
  const bool has_parts = entity.convex_parts.has_value();
  diagnostics.add(has_parts ? entity.convex_parts->place : entity.solid_place,
                  (has_parts ? "'convex_parts': " : "'solid': ") + valid.error().message);
  return options;
}

/// The reader of the scenario checks the scale of other shapes; the size of a mesh is known only now.
void check_scale(const config::WorldEntity& entity, const rtstdb::Bounds& bounds,
                 config::Diagnostics& diagnostics) {
  if (!std::holds_alternative<config::FileShape>(entity.shape) &&
      !std::holds_alternative<config::PartsShape>(entity.shape))
    return;
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

/// How the top view draws the entity: by the name of its first layer.
report::Layer report_layer(const config::WorldEntity& entity) {
  if (entity.mask.empty()) return report::Layer::structure;
  return report::layer_from(entity.mask.front().text).value_or(report::Layer::structure);
}

/// Points in the entity frame whose convex hull, seen from above, is the outline of the body in any
/// rotation. Not for spheres, whose outline is a circle.
std::vector<glm::dvec3> rim(const config::Shape& shape, const rtstdb::Bounds& bounds) {
  std::vector<glm::dvec3> points;
  if (const auto* cylinder = std::get_if<config::CylinderShape>(&shape)) {
    constexpr int corners = 24;
    for (int i = 0; i < corners; ++i) {
      const double angle = 2.0 * glm::pi<double>() * i / corners;
      for (const float z : {bounds.minimum_m.z, bounds.maximum_m.z})
        points.emplace_back(cylinder->radius_m * std::cos(angle), cylinder->radius_m * std::sin(angle), z);
    }
    return points;
  }
  for (const float x : {bounds.minimum_m.x, bounds.maximum_m.x}) {
    for (const float y : {bounds.minimum_m.y, bounds.maximum_m.y}) {
      for (const float z : {bounds.minimum_m.z, bounds.maximum_m.z})
        points.emplace_back(x, y, z);
    }
  }
  return points;
}

std::vector<report::PointM> circle(const glm::dvec3& center_m, double radius_m) {
  constexpr int corners = 24;
  std::vector<report::PointM> points;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2.0 * glm::pi<double>() * i / corners;
    points.push_back({center_m.x + radius_m * std::cos(angle), center_m.y + radius_m * std::sin(angle)});
  }
  return points;
}

/// Convex hull, counter-clockwise (Andrew's monotone chain).
std::vector<report::PointM> hull(std::vector<report::PointM> points) {
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return std::pair(a.x_m, a.y_m) < std::pair(b.x_m, b.y_m); });
  const auto turns_left = [](const report::PointM& a, const report::PointM& b, const report::PointM& c) {
    return (b.x_m - a.x_m) * (c.y_m - a.y_m) - (b.y_m - a.y_m) * (c.x_m - a.x_m) > 1e-12;
  };
  std::vector<report::PointM> result;
  const auto walk = [&](auto begin, auto end) {
    const std::size_t base = result.size();
    for (auto at = begin; at != end; ++at) {
      while (result.size() >= base + 2 && !turns_left(result[result.size() - 2], result.back(), *at))
        result.pop_back();
      result.push_back(*at);
    }
    result.pop_back();  // the first point of the other half
  };
  walk(points.begin(), points.end());
  walk(points.rbegin(), points.rend());
  return result;
}

std::vector<report::PointM> footprint(const config::WorldEntity& entity, const rtstdb::Bounds& bounds,
                                      const rtstdb::Pose& pose) {
  if (const auto* sphere = std::get_if<config::SphereShape>(&entity.shape))
    return circle(pose.p_world_m, entity.scale * sphere->radius_m);
  std::vector<report::PointM> points;
  for (const glm::dvec3& point : rim(entity.shape, bounds)) {
    const glm::dvec3 p = pose.p_world_m + pose.q_world * (entity.scale * point);
    points.push_back({p.x, p.y});
  }
  return hull(std::move(points));
}

}  // namespace

Scenery make_scenery(const config::World& world, config::Diagnostics& diagnostics) {
  Scenery scenery;
  SurfaceWarnings warnings;
  std::map<ShapeKey, std::optional<std::size_t>> known;  // empty: can not be made, with a mistake
  for (const config::WorldEntity& entity : world.entities) {
    if (!entity.is_body()) {
      scenery.mesh_of.emplace_back();
      continue;
    }
    const auto [at, is_new] = known.try_emplace(key_of(entity));
    if (is_new) {
      if (auto mesh = mesh_of(entity.shape, warnings, diagnostics)) {
        at->second = scenery.meshes.size();
        scenery.bounds.push_back(rtstdb::bounds_of(*mesh));
        scenery.options.push_back(contact_options(entity, *mesh, diagnostics));
        scenery.meshes.push_back(std::move(*mesh));
        scenery.first_entity.push_back(&entity);
      }
    }
    if (at->second) check_scale(entity, scenery.bounds[*at->second], diagnostics);
    scenery.mesh_of.push_back(at->second);
  }
  return scenery;
}

void create_scenery(const config::Scenario& scenario, Scenery& scenery, modules::NamedWorld& world,
                    WorldFields& fields) {
  for (const config::WorldMaterial& material : scenario.world.materials)
    world.add_material(material.name.text, material_of(material));
  for (const config::WorldLight& light : scenario.world.lights)
    world.add_light(light.name.text, light_of(light));
  std::vector<rtstdb::GeometryId> geometries;
  for (std::size_t i = 0; i < scenery.meshes.size(); ++i) {
    const config::WorldEntity& entity = *scenery.first_entity[i];
    rtstdb::GeometryOptions& options = scenery.options[i];
    if (entity.field) options.field = fields.options_of(entity.name.text, *entity.field);
    geometries.push_back(world.add_geometry(scenery.meshes[i], entity.name.text, options));
    if (entity.field) fields.add(geometries.back(), entity.name.text, *entity.field);
    scenery.meshes[i] = {};
    options = {};
  }
  for (std::size_t i = 0; i < scenario.world.entities.size(); ++i) {
    const config::WorldEntity& entity = scenario.world.entities[i];
    rtstdb::EntityRow row;
    if (scenery.mesh_of[i]) row.geometry = geometries[*scenery.mesh_of[i]];
    row.scale = glm::dvec3(entity.scale);
    row.mask = entity.mask_bits;
    if (entity.material)
      row.material = world.material_of(entity.material->text, "entity " + entity.name.text);
    if (entity.light) row.light = world.light_of(entity.light->text, "entity " + entity.name.text);
    row.motion = motion_of(entity);
    world.create(entity.name.text, row);
  }
}

std::vector<rtstdb::Motion> first_motions(const config::World& world) {
  std::vector<rtstdb::Motion> motions;
  motions.reserve(world.entities.size());
  for (const config::WorldEntity& entity : world.entities)
    motions.push_back(motion_of(entity));
  return motions;
}

std::vector<report::Shape> outlines(const config::Scenario& scenario, const Scenery& scenery,
                                    std::span<const rtstdb::Motion> motions, std::int64_t time_ns) {
  std::vector<report::Shape> shapes;
  for (std::size_t i = 0; i < scenario.world.entities.size(); ++i) {
    const config::WorldEntity& entity = scenario.world.entities[i];
    if (!scenery.mesh_of[i]) continue;
    const rtstdb::Pose pose = rtstdb::pose_at(motions[i], rtstdb::world_time_ns(time_ns));
    shapes.push_back({.layer = report_layer(entity),
                      .label = entity.name.text,
                      .footprint = footprint(entity, scenery.bounds[*scenery.mesh_of[i]], pose),
                      .body_layer = entity.mask.empty() ? std::string() : entity.mask.front().text});
  }
  return shapes;
}

}  // namespace hil::run
