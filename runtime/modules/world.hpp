#pragma once
// The world while modules are configured: the database, the mask bits of the layers, and the materials, the
// lights and the entities by name.
//
// A run without bodies whose modules need no world (ModuleType::needs_world) has no database. database() and
// all members that add to the world are then misuse (asserts).
//
// Threads: configuration, one thread.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/contribution/world_record.hpp"
#include "runtime/modules/camera_images.hpp"
#include "runtime/modules/point_cloud.hpp"

namespace hil::modules {

class World {
 public:
  /// `database`: null when the run has none; outlives it.
  World(rtstdb::Database* database, std::vector<std::string> layers);

  rtstdb::Database& database() noexcept;

  /// The mask bit of a layer; empty when the scenario has no layer of that name.
  std::optional<std::uint32_t> layer_bit(const std::string& layer) const;
  /// The mask of several layers. Throws SetupError for an unknown one; the sentence begins with `caller`, as
  /// "module scanner".
  std::uint32_t mask_of(const std::vector<std::string>& layers, const std::string& caller) const;
  const std::vector<std::string>& layers() const noexcept { return layers_; }

  /// Adds geometry. Throws SetupError with the database's error text.
  rtstdb::GeometryId add_geometry(const rtstdb::TriangleMesh& mesh, const std::string& name,
                                  const rtstdb::GeometryOptions& options = {});

  /// The geometry of a shape, made at the first call with its key and shared from then on. All modules share
  /// the keys, so a key begins with the kind of shape ("car ..."). Throws SetupError.
  rtstdb::GeometryId shared_geometry(const std::string& key,
                                     const std::function<rtstdb::TriangleMesh()>& make);

  /// Adds a material with a name that is not in use. Throws SetupError with the database's error text.
  rtstdb::MaterialId add_material(const std::string& name, const rtstdb::Material& material);
  /// A material of world.materials. Throws SetupError for an unknown name; the sentence begins with `caller`.
  rtstdb::MaterialId material_of(const std::string& name, const std::string& caller) const;
  /// The same for lights and world.lights.
  rtstdb::LightId add_light(const std::string& name, const rtstdb::Light& light);
  rtstdb::LightId light_of(const std::string& name, const std::string& caller) const;

  /// Creates an entity at run time 0 with a name ("traffic.ego", "house_1"). Throws SetupError when the
  /// name is in use or the database refuses the row.
  rtstdb::EntityId create(const std::string& name, const rtstdb::EntityRow& row);

  /// The run's files for point clouds; null: the run writes none.
  PointCloudSink* point_clouds() const noexcept { return point_clouds_; }
  void set_point_clouds(PointCloudSink* sink) noexcept { point_clouds_ = sink; }
  /// The run's files for images of cameras; null: the run writes none.
  CameraImageSink* camera_images() const noexcept { return camera_images_; }
  void set_camera_images(CameraImageSink* sink) noexcept { camera_images_ = sink; }

  /// Reserves device time for a module's hard transactions, until the world is destroyed. Null when the
  /// database refuses the reservation: not_reserved() then contains its reason, and the transactions have
  /// none.
  rtstdb::Reservation* reserve(const rtstdb::ReservationOptions& options);
  const std::vector<std::string>& not_reserved() const noexcept { return not_reserved_; }

  std::optional<rtstdb::EntityId> find(const std::string& name) const;
  /// Throws SetupError when there is no entity of that name; the sentence begins with `caller`.
  rtstdb::EntityId entity_of(const std::string& name, const std::string& caller) const;
  /// The name that create() was given; empty for entities that it did not create.
  const std::string& name_of(rtstdb::EntityId entity) const;
  /// Fills in the layers, and the entities that create() created, by ascending index.
  void describe(contribution::WorldRecord& record) const;
  /// Box of the entity's geometry in the entity frame, unscaled. The entity is one that create() created, and
  /// has a geometry.
  rtstdb::Bounds bounds_of(rtstdb::EntityId entity) const;
  /// GeometryInfo::convex_parts of the entity's geometry; 0 without one. The entity is one that create()
  /// created.
  std::uint32_t convex_parts_of(rtstdb::EntityId entity) const;

 private:
  rtstdb::Database* database_;
  PointCloudSink* point_clouds_ = nullptr;
  CameraImageSink* camera_images_ = nullptr;
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
