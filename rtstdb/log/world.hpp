#pragma once
// The world as a log tells it: starts empty or from a checkpoint, and takes record after record. Every record is held to what
// those before it left, so that a state which never was is not made up.

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
  TriangleMesh mesh;  ///< as it was added
  Version shape_version = 0;
  std::vector<glm::vec3> positions_m;  ///< of the current shape; empty: as it was added
};

class World {
 public:
  VersionInfo latest{0, world_time_ns(-max_world_time_ns)};
  Version next_version = 1;                ///< above every version that was told of
  std::vector<EntityState> rows;           ///< by index; an invalid id where no entity lives
  std::vector<std::uint32_t> generations;  ///< by index, the last that was given
  std::vector<WorldGeometry> geometries;   ///< by index

  // What is wrong, or null; then nothing has changed.
  /// A version after the latest. It can be taken back until the next call. Each write of the
  /// set has the whole row then, as it leaves it.
  const char* apply(store::WriteSet& set);
  /// The latest version, which was applied last.
  const char* take_back(Version version);
  /// The next geometry, or one that is there and is the same; `mesh` is moved from.
  const char* add(const LoggedGeometry& geometry, TriangleMesh&& mesh);
  /// Of the latest version; none in the world before all versions.
  std::optional<WorldTime> time() const noexcept {
    return latest.version != 0 ? std::optional(latest.time) : std::nullopt;
  }
  bool knows(GeometryId geometry) const noexcept { return geometry.index < geometries.size(); }

  /// For Store::restore, after Store::keep_shapes of geometry that deforms. Points into this.
  store::RestoredRows restored() const noexcept { return {latest, next_version, rows, generations}; }
  /// Both of them.
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

  // How it was before the version that was applied last.
  bool can_take_back_ = false;
  VersionInfo latest_before_;
  std::vector<Before> before_;
  std::vector<ShapeBefore> shapes_before_;
};

}  // namespace rtstdb::log
