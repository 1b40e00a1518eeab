#pragma once
// From a directory to the world that it tells of: the newest whole checkpoint, and the records behind it. It changes nothing
// in the directory; whoever goes on to write has its lock.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rtstdb/result.hpp>
#include <rtstdb/time.hpp>

#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/reader.hpp"
#include "rtstdb/log/world.hpp"

namespace rtstdb::log {

struct RecoveryOptions {
  /// The world as it was: the newest version that is not above, or that had begun by then. Absent: the newest.
  std::optional<Version> up_to_version = std::nullopt;
  std::optional<WorldTime> up_to_time = std::nullopt;
  /// A damaged log is opened up to the version before the damage.
  bool salvage = false;
  /// What `duration` is measured by; may be null.
  const Clock* clock = nullptr;
};

struct RecoveryReport {
  std::uint64_t database_id = 0;  ///< 0: there is no database yet
  std::uint64_t checkpoint = 0;   ///< 0: from the empty world
  Version checkpoint_version = 0;
  Position read_from;  ///< where reading of groups began
  /// Newer checkpoints that were not whole, or a geometry of theirs was not, in words.
  std::vector<std::string> damaged_checkpoints;
  ReadReport log;
  std::uint64_t versions = 0;  ///< applied from records
  /// Versions that are not in the log; the world is as it was before them. 0: none were met.
  Version gap_from = 0, gap_to = 0;
  /// The version that whole groups lead to: before the world's where reading ended within a group, or began within a gap.
  Version version_of_groups = 0;
  Nanoseconds duration{0};

  /// A sentence or more: what was found, what was cut and why.
  std::string in_words() const;
};

struct Recovered {
  World world;
  RecoveryReport report;
  Listing listing;
};

/// Refuses, as ErrorCode::file: damage, with its place; an unknown format; files of another database; a geometry whose file is
/// not whole; a gap behind which only a damaged checkpoint goes on; and, salvaging too, what the disk does not read.
Result<Recovered> recover(Disk& disk, const RecoveryOptions& options = {});

}  // namespace rtstdb::log
