#include <algorithm>
#include <utility>

#include <rtstdb/result.hpp>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {
namespace {

std::vector<std::shared_ptr<const MeshTree>> trees_of(std::span<const TriangleMesh* const> meshes) {
  std::vector<std::shared_ptr<const MeshTree>> trees;
  trees.reserve(meshes.size());
  for (const TriangleMesh* mesh : meshes)
    trees.push_back(mesh == nullptr ? nullptr : std::make_shared<const MeshTree>(*mesh));
  return trees;
}

}  // namespace

World::World(std::vector<EntityState> entities, std::span<const TriangleMesh* const> meshes,
             WorldTime version_time)
    : World(std::move(entities), trees_of(meshes), version_time) {
  for (std::size_t i = 0; i < meshes.size(); ++i)
    if (meshes[i] != nullptr) pieces_[i] = convex_pieces(*meshes[i], meshes_[i]);
}

World::World(std::vector<EntityState> entities, std::vector<std::shared_ptr<const MeshTree>> meshes,
             WorldTime version_time)
    : entities_(std::move(entities)),
      meshes_(std::move(meshes)),
      pieces_(meshes_.size()),
      version_time_(version_time) {
  for (std::size_t i = 0; i < entities_.size(); ++i) {
    RTSTDB_ASSERT(i == 0 || entities_[i - 1].id.index < entities_[i].id.index,
                  "the entities are not in the order of their indices");
    if (!entities_[i].row.geometry.valid()) continue;
    RTSTDB_ASSERT(entities_[i].row.geometry.index < meshes_.size(), "an entity has an unknown geometry");
    RTSTDB_ASSERT(meshes_[entities_[i].row.geometry.index] != nullptr, "the mesh of an entity is null");
  }
}

World World::with_entities(std::vector<EntityState> entities, WorldTime version_time) const {
  World other(std::move(entities), meshes_, version_time);
  other.pieces_ = pieces_;
  return other;
}

void World::mark_deforming(GeometryId geometry) {
  pieces_[geometry.index].clear();
}

bool World::has_inside(const EntityState& entity) const noexcept {
  return mesh_of(entity).closed();
}

const MeshTree& World::mesh_of(const EntityState& entity) const noexcept {
  return *meshes_[entity.row.geometry.index];
}

std::span<const ConvexPiece> World::parts_of(const EntityState& entity) const noexcept {
  return pieces_[entity.row.geometry.index];
}

const EntityState* World::find(EntityId id) const noexcept {
  const auto place = std::lower_bound(
      entities_.begin(), entities_.end(), id.index,
      [](const EntityState& entity, std::uint32_t index) { return entity.id.index < index; });
  return place != entities_.end() && place->id == id ? &*place : nullptr;
}

}  // namespace rtstdb::oracle
