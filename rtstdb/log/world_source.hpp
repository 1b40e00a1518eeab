#pragma once
// Where a checkpoint gets the world from: one version, slice by slice, so that nobody waits for the whole. The caller has it
// from a snapshot, or from a copy that follows the log.
//
// Threads: called on the log's thread alone.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rtstdb/log/record.hpp"

namespace rtstdb::log {

struct WorldHead {
  VersionInfo version;
  Version next_version = 1;
  std::uint32_t index_limit = 0;  ///< rows live below
  /// All of that version, and of any record that was put before `begin`; ascending.
  std::vector<LoggedGeometry> geometries;
};

class WorldSource {
 public:
  virtual ~WorldSource() = default;
  /// A settled version that was the newest when this was asked first, or one after it; `not_before` is the newest that the asker
  /// knows of. None: not yet, asked again. A version that was begun and not ended is let go.
  virtual std::optional<WorldHead> begin(Version not_before) = 0;
  /// The states of indices from `first` on as they are in that version. Where no entity lives the id has an invalid index and the
  /// generation that was given last. False: the version is not kept any more.
  virtual bool rows(std::uint32_t first, std::span<EntityState> states) = 0;
  struct Shape {
    Version version = 0;  ///< that made it; 0: it is as the geometry was added
    std::vector<glm::vec3> positions_m;
  };
  /// Of a geometry that deforms. False: the version is not kept any more.
  virtual bool shape(GeometryId geometry, Shape& shape) = 0;
  virtual void end() noexcept = 0;
};

}  // namespace rtstdb::log
