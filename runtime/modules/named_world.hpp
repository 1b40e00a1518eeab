#pragma once
// The world of a run, as its modules get it, and the names that its records need.
//
// A run without bodies whose modules need no world has no database. database() and all members that add to
// the world are then misuse (asserts).
//
// Threads: configuration, one thread.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <hil/world/world.hpp>
#include <rtstdb/database.hpp>

#include "runtime/contribution/world_record.hpp"

namespace hil::modules {

class NamedWorld final : public World {
 public:
  /// `database`: null when the run has none; outlives it.
  NamedWorld(rtstdb::Database* database, std::vector<std::string> layers);

  rtstdb::Database& database() noexcept override;
  std::optional<std::uint32_t> layer_bit(const std::string& layer) const override;
  std::uint32_t mask_of(const std::vector<std::string>& layers, const std::string& caller) const override;
  const std::vector<std::string>& layers() const noexcept override { return layers_; }
  using World::add_geometry;
  rtstdb::GeometryId add_geometry(const rtstdb::TriangleMesh& mesh, const std::string& name,
                                  const rtstdb::GeometryOptions& options) override;
  rtstdb::GeometryId shared_geometry(const std::string& key,
                                     const std::function<rtstdb::TriangleMesh()>& make) override;
  rtstdb::MaterialId material_of(const std::string& name, const std::string& caller) const override;
  rtstdb::LightId light_of(const std::string& name, const std::string& caller) const override;
  rtstdb::EntityId create(const std::string& name, const rtstdb::EntityRow& row) override;
  rtstdb::Reservation* reserve(const rtstdb::ReservationOptions& options) override;
  std::optional<rtstdb::EntityId> find(const std::string& name) const override;
  rtstdb::EntityId entity_of(const std::string& name, const std::string& caller) const override;
  const std::string& name_of(rtstdb::EntityId entity) const override;
  rtstdb::Bounds bounds_of(rtstdb::EntityId entity) const override;
  std::uint32_t convex_parts_of(rtstdb::EntityId entity) const override;

  /// Adds a material with a name that is not in use. Throws SetupError with the database's error text.
  rtstdb::MaterialId add_material(const std::string& name, const rtstdb::Material& material);
  rtstdb::LightId add_light(const std::string& name, const rtstdb::Light& light);
  /// Why the database refused reservations, one sentence for each.
  const std::vector<std::string>& not_reserved() const noexcept { return not_reserved_; }
  /// Fills in the layers, and the entities that create() created, by ascending index.
  void describe(contribution::WorldRecord& record) const;

 private:
  rtstdb::Database* database_;
  std::vector<std::string> layers_;
  std::unique_ptr<rtstdb::Transaction> creation_;
  std::vector<std::unique_ptr<rtstdb::Reservation>> reservations_;
  std::vector<std::string> not_reserved_;
  std::vector<rtstdb::Bounds> geometry_bounds_;                    // by geometry index
  std::unordered_map<std::string, rtstdb::GeometryId> shared_;     // by key
  std::unordered_map<std::string, rtstdb::MaterialId> materials_;  // by name
  std::unordered_map<std::string, rtstdb::LightId> lights_;        // by name
  std::unordered_map<std::string, rtstdb::EntityId> by_name_;
  std::vector<std::string> names_;                 // by entity index
  std::vector<std::uint32_t> generations_;         // by entity index
  std::vector<std::uint32_t> geometry_of_entity_;  // by entity index
};

}  // namespace hil::modules
