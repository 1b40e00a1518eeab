#include "rtstdb/query/image/image_lights.hpp"

#include <glm/ext/quaternion_geometric.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <rtstdb/limits.hpp>

#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

constexpr glm::quat no_rotation{1.0f, 0.0f, 0.0f, 0.0f};

shared::uint kind_of(LightKind kind) noexcept {
  switch (kind) {
    case LightKind::directional:
      return shared::light_directional;
    case LightKind::point:
      return shared::light_point;
    case LightKind::spot:
      return shared::light_spot;
    case LightKind::sky:
      break;
  }
  return shared::light_sky;
}

/// Where a kind stands in the list.
std::uint32_t rank_of(const shared::LightRecord& light) noexcept {
  switch (light.kind) {
    case shared::light_sky:
      return 0;
    case shared::light_directional:
      return 1;
    case shared::light_emitter:
      return 3;
    default:
      return 2;
  }
}

/// Shadow maps that a light needs. A view of more than 120 degrees would have few texels at its middle.
std::uint32_t maps_of(const shared::LightRecord& light) noexcept {
  if (light.kind == shared::light_directional) return shared::shadow_squares;
  return light.kind == shared::light_spot && light.cos_outer >= 0.5f ? 1 : shared::shadow_faces;
}

std::span<const glm::vec3> positions_of(GeometryId geometry, const BatchWorld& world) noexcept {
  if (world.pool.deforms(geometry.index)) return world.rows.shape(geometry).positions_m;
  return world.pool.mesh(geometry.index).positions_m;
}

float half_cosine(double full_angle_rad) noexcept {
  return static_cast<float>(std::cos(0.5 * full_angle_rad));
}

}  // namespace

ImageLights::ImageLights(std::span<const FixedLight> fixed, std::uint32_t zones)
    : fixed_(fixed),
      emits_(max_materials),
      zones_per_surface_(zones),
      divider_(zones, zones == 0 ? 0 : max_emitter_triangles) {
  records_.reserve(max_lights_per_image);
  meshes_.reserve(max_lights_per_image);
  zone_sets_.reserve(max_lights_per_image);
}

void ImageLights::collect(const BatchWorld& world, std::uint32_t mask, const Buffers& buffers,
                          std::uint32_t max_maps) noexcept {
  if (known_ && version_ == world.rows.version() && mask_ == mask) return;
  known_ = true;
  version_ = world.rows.version();
  mask_ = mask;
  for (std::uint32_t id = 0; id < world.appearance.materials(); ++id)
    emits_[id] = world.appearance.material({id})->emission_cdpm2 != glm::dvec3(0.0);
  records_.clear();
  meshes_.clear();
  used_triangles_ = 0;
  overflow_ = false;
  for (const FixedLight& fixed : fixed_)
    add_light(fixed.light, shared::no_entity, mask_all, glm::normalize(fixed.q_world));
  for (std::uint32_t index = 0; index < world.rows.index_limit(); ++index) {
    const EntityState* state = world.rows.row(index);
    if (state == nullptr || (state->row.mask & mask) == 0) continue;
    if (state->row.light.valid())
      add_light(*world.appearance.light(state->row.light), state->id.index, state->row.mask, no_rotation);
    if (state->row.geometry.valid() && emits_[state->row.material.index])
      add_emitter(*state, *world.appearance.material(state->row.material), world, buffers.triangles);
  }
  std::ranges::sort(records_, {}, [](const auto& light) { return std::pair(rank_of(light), light.entity); });
  const auto before = [&](std::uint32_t rank) {
    return static_cast<std::uint32_t>(
        std::ranges::count_if(records_, [&](const auto& light) { return rank_of(light) < rank; }));
  };
  counts_ = {.skies = before(1),
             .suns_end = before(2),
             .emitters_from = before(3),
             .all = static_cast<std::uint32_t>(records_.size()),
             .mapped_end = 0,
             .maps = 0};
  assign_maps(max_maps);
  if (zones_per_surface_ > 0) assign_zones(world, buffers);
  std::ranges::copy(records_, buffers.lights.begin());
}

void ImageLights::assign_maps(std::uint32_t max_maps) noexcept {
  std::uint32_t k = counts_.skies;
  for (; k < counts_.emitters_from; ++k) {
    shared::LightRecord& light = records_[k];
    const std::uint32_t maps = maps_of(light);
    if (counts_.maps + maps > max_maps) break;
    light.first_map = counts_.maps;
    light.maps = maps;
    counts_.maps += maps;
  }
  counts_.mapped_end = k;
}

ImageLights::MapOfLight ImageLights::map(std::uint32_t index) const noexcept {
  std::uint32_t light = counts_.skies;
  while (index >= records_[light].first_map + records_[light].maps)
    ++light;
  return {light, index - records_[light].first_map};
}

void ImageLights::add_light(const Light& light, std::uint32_t entity, std::uint32_t mask,
                            const glm::quat& q) noexcept {
  if (records_.size() == max_lights_per_image) {
    overflow_ = true;
    return;
  }
  const bool is_sky = light.kind == LightKind::sky;
  const bool is_directional = light.kind == LightKind::directional;
  const double value = is_directional ? light.illuminance_lx : light.intensity_cd;
  records_.push_back(
      {.kind = kind_of(light.kind),
       .entity = entity,
       .first_triangle = 0,
       .triangles = 0,
       .color = glm::vec3(light.color * (is_sky ? light.zenith_cdpm2 : glm::dvec3(value))),
       .mask = mask,
       .horizon = glm::vec3(light.color * light.horizon_cdpm2),
       .cos_inner = half_cosine(light.inner_angle_rad),
       .ground = glm::vec3(light.color * light.ground_cdpm2),
       .cos_outer = half_cosine(is_directional ? light.angular_diameter_rad : light.outer_angle_rad),
       .first_map = 0,
       .maps = 0,
       .q = {q.x, q.y, q.z, q.w},
       .p_m = glm::vec3(light.p_m),
       .first_zone = 0});
}

void ImageLights::add_emitter(const EntityState& state, const Material& material, const BatchWorld& world,
                              std::span<shared::EmitterTriangle> triangles) noexcept {
  const Mesh* mesh =
      records_.size() == max_lights_per_image ? nullptr : mesh_of(state.row.geometry, world, triangles);
  if (mesh == nullptr) {
    overflow_ = true;
    return;
  }
  records_.push_back({.kind = shared::light_emitter,
                      .entity = state.id.index,
                      .first_triangle = mesh->first,
                      .triangles = mesh->count,
                      .color = glm::vec3(material.emission_cdpm2),
                      .mask = state.row.mask,
                      .horizon = glm::vec3(0.0f),
                      .cos_inner = 0.0f,
                      .ground = glm::vec3(0.0f),
                      .cos_outer = 0.0f,
                      .first_map = 0,
                      .maps = 0,
                      .q = {0.0f, 0.0f, 0.0f, 1.0f},
                      .p_m = glm::vec3(0.0f),
                      .first_zone = 0});
}

const ImageLights::Mesh* ImageLights::mesh_of(GeometryId geometry, const BatchWorld& world,
                                              std::span<shared::EmitterTriangle> triangles) noexcept {
  if (const auto found = std::ranges::find(meshes_, geometry, &Mesh::geometry); found != meshes_.end())
    return &*found;
  const TriangleMesh& mesh = world.pool.mesh(geometry.index);
  if (used_triangles_ + mesh.triangles.size() > triangles.size()) return nullptr;
  const std::span<const glm::vec3> positions_m = positions_of(geometry, world);
  const auto added = triangles.subspan(used_triangles_, mesh.triangles.size());
  const auto corner = [&](std::uint32_t k) { return glm::dvec3(positions_m[k]); };
  const glm::dvec3 origin = mesh.triangles.empty() ? glm::dvec3(0.0) : corner(mesh.triangles[0].x);
  double area = 0.0, volume = 0.0;
  for (std::size_t k = 0; k < added.size(); ++k) {
    const glm::uvec3 corners = mesh.triangles[k];
    const glm::dvec3 a = corner(corners.x), b = corner(corners.y), c = corner(corners.z);
    const glm::dvec3 across = glm::cross(b - a, c - a);
    const double own = 0.5 * glm::length(across);
    added[k] = {.a_m = glm::vec3(a),
                .below = static_cast<float>(area),
                .b_m = glm::vec3(b),
                .share = static_cast<float>(own),
                .c_m = glm::vec3(c),
                .unused = 0.0f};
    area += own;
    volume += glm::dot(across, a - origin);
  }
  const auto per_area = static_cast<float>(1.0 / std::max(area, 1e-30));
  for (shared::EmitterTriangle& triangle : added) {
    triangle.below *= per_area;
    triangle.share *= per_area;
    // The front is made the outer side; that of an open mesh is any.
    if (volume < 0.0) std::swap(triangle.b_m, triangle.c_m);
  }
  meshes_.push_back({geometry, used_triangles_, static_cast<std::uint32_t>(added.size())});
  used_triangles_ += static_cast<std::uint32_t>(added.size());
  return &meshes_.back();
}

// ---- zones

bool ImageLights::use_zone_set(shared::LightRecord& light, const ZoneSet& key) noexcept {
  const auto found = std::ranges::find_if(zone_sets_, [&](const ZoneSet& set) {
    return set.geometry == key.geometry && set.scale == key.scale && set.version == key.version;
  });
  if (found == zone_sets_.end()) return false;
  found->is_used = true;
  light.first_zone = static_cast<std::uint32_t>(found - zone_sets_.begin()) * zones_per_surface_;
  return true;
}

/// Surfaces that have zones come first, so that new zones replace none that are used.
void ImageLights::assign_zones(const BatchWorld& world, const Buffers& buffers) noexcept {
  const auto surfaces = std::span(records_).subspan(counts_.emitters_from);
  const auto set_of = [&](const shared::LightRecord& light) {
    const EntityRow& row = world.rows.row(light.entity)->row;
    const bool deforms = world.pool.deforms(row.geometry.index);
    return ZoneSet{row.geometry, row.scale, deforms ? world.rows.shape(row.geometry).version : 0, true};
  };
  for (ZoneSet& set : zone_sets_)
    set.is_used = false;
  for (shared::LightRecord& light : surfaces)
    use_zone_set(light, set_of(light));
  for (shared::LightRecord& light : surfaces) {
    const ZoneSet set = set_of(light);
    if (use_zone_set(light, set)) continue;
    auto place = std::ranges::find(zone_sets_, false, &ZoneSet::is_used);
    if (zone_sets_.size() < max_lights_per_image)
      place = zone_sets_.insert(zone_sets_.end(), set);
    else
      *place = set;
    light.first_zone = static_cast<std::uint32_t>(place - zone_sets_.begin()) * zones_per_surface_;
    divider_.divide(world.pool.mesh(set.geometry.index).triangles, positions_of(set.geometry, world),
                    set.scale, buffers.zones.subspan(light.first_zone, zones_per_surface_),
                    buffers.points.subspan(std::size_t{light.first_zone} * shared::points_per_zone,
                                           std::size_t{zones_per_surface_} * shared::points_per_zone));
  }
}

}  // namespace rtstdb::query
