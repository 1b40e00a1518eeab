#pragma once
// Where a writer goes on: what recovery found, said in the writer's terms.

#include <cstdint>
#include <optional>
#include <vector>

#include "rtstdb/log/position.hpp"
#include "rtstdb/log/recovery.hpp"

namespace rtstdb::log {

struct LogStart {
  std::uint64_t database_id = 0;
  std::uint64_t next_segment = 1, next_checkpoint = 1;
  /// That are newer than where the log goes on: were they good again, they would lead away from it.
  std::vector<std::uint64_t> abandoned_checkpoints;
  Position next;
  /// The last group, which may not be on disk though it can be read: the first segment begins with it.
  std::optional<Position> last;
  std::uint64_t last_bytes = 0;
  Version version = 0;         ///< the world's
  Version newest_version = 0;  ///< that was ever told of
  /// That the groups before `next` lead to. Where it is not the world's, the world is safe when a checkpoint has it.
  Version version_of_groups = 0;
  std::size_t geometries = 0;        ///< the world's
  std::uint64_t replayed_bytes = 0;  ///< since the last checkpoint
};

/// `new_database_id` names a database that is not there yet.
LogStart start_after(const Recovered& recovered, std::uint64_t new_database_id);

}  // namespace rtstdb::log
