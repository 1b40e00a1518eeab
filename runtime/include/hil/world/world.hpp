#pragma once
// The world while modules are configured: the database, the mask bits of the layers, and the materials, the
// lights and the entities by name.
//
// Threads: configuration, one thread.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include <hil/module.hpp>
#include <rtstdb/database.hpp>

namespace hil::modules {

/// The database refused a call of `caller`, as "module scanner".
class RefusedByDatabase : public SetupError {
 public:
  RefusedByDatabase(const std::string& caller, const rtstdb::Error& error);
};

class World {
 public:
  virtual ~World() = default;

  virtual rtstdb::Database& database() noexcept = 0;

  /// The mask bit of a layer; empty when the scenario has no layer of that name.
  virtual std::optional<std::uint32_t> layer_bit(const std::string& layer) const = 0;
  /// The mask of several layers. Throws SetupError for an unknown one; the sentence begins with `caller`, as
  /// "module scanner".
  virtual std::uint32_t mask_of(const std::vector<std::string>& layers, const std::string& caller) const = 0;
  virtual const std::vector<std::string>& layers() const noexcept = 0;

  /// Adds geometry. Throws SetupError with the database's error text.
  virtual rtstdb::GeometryId add_geometry(const rtstdb::TriangleMesh& mesh, const std::string& name,
                                          const rtstdb::GeometryOptions& options) = 0;
  rtstdb::GeometryId add_geometry(const rtstdb::TriangleMesh& mesh, const std::string& name) {
    return add_geometry(mesh, name, {});
  }
  /// The geometry of a shape, made at the first call with its key and shared from then on. All modules share
  /// the keys, so a key begins with the kind of shape ("car ..."). Throws SetupError.
  virtual rtstdb::GeometryId shared_geometry(const std::string& key,
                                             const std::function<rtstdb::TriangleMesh()>& make) = 0;

  /// A material of world.materials. Throws SetupError for an unknown name; the sentence begins with `caller`.
  virtual rtstdb::MaterialId material_of(const std::string& name, const std::string& caller) const = 0;
  /// The same for lights and world.lights.
  virtual rtstdb::LightId light_of(const std::string& name, const std::string& caller) const = 0;

  /// Creates an entity at run time 0 with a name ("traffic.ego", "house_1"). Throws SetupError when the
  /// name is in use or the database refuses the row.
  virtual rtstdb::EntityId create(const std::string& name, const rtstdb::EntityRow& row) = 0;

  /// Reserves device time for a module's hard transactions, to the end of the run. Null when the database
  /// refuses the reservation, which the report says: the transactions have none.
  virtual rtstdb::Reservation* reserve(const rtstdb::ReservationOptions& options) = 0;

  virtual std::optional<rtstdb::EntityId> find(const std::string& name) const = 0;
  /// Throws SetupError when there is no entity of that name; the sentence begins with `caller`.
  virtual rtstdb::EntityId entity_of(const std::string& name, const std::string& caller) const = 0;
  /// The name that create() was given; empty for entities that it did not create.
  virtual const std::string& name_of(rtstdb::EntityId entity) const = 0;
  /// Box of the entity's geometry in the entity frame, unscaled. The entity is one that create() created, and
  /// has a geometry.
  virtual rtstdb::Bounds bounds_of(rtstdb::EntityId entity) const = 0;
  /// GeometryInfo::convex_parts of the entity's geometry; 0 without one. The entity is one that create()
  /// created.
  virtual std::uint32_t convex_parts_of(rtstdb::EntityId entity) const = 0;
};

}  // namespace hil::modules
