#pragma once
// The world while a log is read: starts empty or from a checkpoint, and applies record after record. Each
// record is checked against the world before it, so that no state arises that never existed.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>

#include "rtstdb/log/record.hpp"
#include "rtstdb/store/store.hpp"

namespace rtstdb::log {

struct WorldGeometry {
  LoggedGeometry logged;
  StoredMesh mesh;  ///< as it was added
  Version shape_version = 0;
  std::vector<glm::vec3> positions_m;  ///< of the current shape; empty: as it was added
};

class World {
 public:
  VersionInfo latest{0, world_time_ns(-max_world_time_ns)};
  Version next_version = 1;                ///< above every version in the log so far
  std::vector<EntityState> rows;           ///< by index; an invalid id where no entity lives
  std::vector<std::uint32_t> generations;  ///< by index: the last generation
  std::vector<WorldGeometry> geometries;   ///< by index
  std::vector<LoggedMaterial> materials;   ///< by index - 1: without the default material
  std::vector<LoggedLight> lights;         ///< by index

  // Each of these returns null, or a description of the fault; then nothing has changed.
  /// Applies a version after the latest. It can be discarded until the next call. Afterwards each write of
  /// the set has the whole row that it leaves.
  const char* apply(store::WriteSet& set);
  /// Undoes the latest version, which must have been applied last.
  const char* discard(Version version);
  /// Adds the next geometry; one that exists must be equal. `mesh` is moved from.
  const char* add(const LoggedGeometry& geometry, StoredMesh&& mesh);
  /// Adds the next material or light; one that exists must be equal.
  const char* add(const LoggedMaterial& material);
  const char* add(const LoggedLight& light);
  /// World time of the latest version; none for version 0.
  std::optional<WorldTime> time() const noexcept {
    return latest.version != 0 ? std::optional(latest.time) : std::nullopt;
  }
  bool knows(GeometryId geometry) const noexcept { return geometry.index < geometries.size(); }
  bool knows(MaterialId material) const noexcept { return material.index <= materials.size(); }
  bool knows(LightId light) const noexcept { return light.index < lights.size(); }

  /// For Store::restore, after Store::keep_shapes for deforming geometry. Points into this object.
  store::RestoredRows restored() const noexcept { return {latest, next_version, rows, generations}; }
  /// Calls keep_shapes and restore of an empty store.
  void restore(store::Store& store) const;
  std::span<const glm::vec3> shape_of(const WorldGeometry& geometry) const noexcept {
    return geometry.positions_m.empty() ? std::span(geometry.mesh.positions_m)
                                        : std::span(geometry.positions_m);
  }

 private:
  struct Before {
    std::uint32_t index = 0;
    std::uint32_t generation = 0;
    EntityState state;
  };
  struct ShapeBefore {
    std::uint32_t geometry = 0;
    Version version = 0;
    std::vector<glm::vec3> positions_m;
  };
  const char* apply(store::Write& write);
  const char* apply(const store::ShapeWrite& write, Version version);
  void undo();

  // The state before the version that was applied last.
  bool can_discard_ = false;
  VersionInfo latest_before_;
  std::vector<Before> before_;
  std::vector<ShapeBefore> shapes_before_;
};

}  // namespace rtstdb::log
