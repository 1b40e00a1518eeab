#pragma once
// Where a writer continues the log: the result of the recovery in the terms of the writer.

#include <cstdint>
#include <optional>
#include <vector>

#include "rtstdb/log/added_counts.hpp"
#include "rtstdb/log/position.hpp"
#include "rtstdb/log/recovery.hpp"

namespace rtstdb::log {

struct LogStart {
  std::uint64_t database_id = 0;
  std::uint64_t next_segment = 1, next_checkpoint = 1;
  /// Checkpoints newer than the point where a salvaged log continues. A later recovery must not start from
  /// them.
  std::vector<std::uint64_t> abandoned_checkpoints;
  Position next;
  /// The last group. It was read but may not be on disk, so the first new segment begins with a copy of it.
  std::optional<Position> last;
  std::uint64_t last_bytes = 0;
  Version version = 0;         ///< of the recovered world
  Version newest_version = 0;  ///< the newest version that the log mentions
  /// Version that the groups before `next` lead to. If it is not the version of the world, the world is
  /// durable only with a checkpoint.
  Version version_of_groups = 0;
  AddedCounts added;                 ///< of the recovered world
  std::uint64_t replayed_bytes = 0;  ///< bytes of groups since the last checkpoint
};

/// `new_database_id`: the id for a log that does not exist yet.
LogStart start_after(const Recovered& recovered, std::uint64_t new_database_id);

}  // namespace rtstdb::log
