#pragma once
// The source of a checkpoint's world: one version, delivered in slices, so that no thread waits for all of
// it. Implemented by a snapshot, or by a copy that follows the log.
//
// Threads: called on the log thread only.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rtstdb/log/record.hpp"

namespace rtstdb::log {

struct WorldHead {
  VersionInfo version;
  Version next_version = 1;
  std::uint32_t index_limit = 0;  ///< above the index of every row
  /// All geometries of that version and of any record put into the ring before `begin`; ascending.
  std::vector<LoggedGeometry> geometries;
  std::vector<LoggedMaterial> materials;  ///< likewise
  std::vector<LoggedLight> lights;        ///< likewise
};

class WorldSource {
 public:
  virtual ~WorldSource() = default;
  /// Selects the newest settled version at the first call, or a later one. `not_before`: the newest version
  /// known to the caller. None: not ready, call again. A version selected before and not ended is released.
  virtual std::optional<WorldHead> begin(Version not_before) = 0;
  /// The states of the indices from `first` on in that version. If no entity lives at an index, its id has an
  /// invalid index and the last generation. False: the version is no longer kept.
  virtual bool rows(std::uint32_t first, std::span<EntityState> states) = 0;
  struct Shape {
    Version version = 0;  ///< the version that made it; 0: the shape that the geometry was added with
    std::vector<glm::vec3> positions_m;
  };
  /// The shape of a deforming geometry in that version. False: the version is no longer kept.
  virtual bool shape(GeometryId geometry, Shape& shape) = 0;
  /// Releases the version.
  virtual void end() noexcept = 0;
};

}  // namespace rtstdb::log
