#pragma once
// Recovers the world from the directory of a log: the newest undamaged checkpoint and the records after it.
// Nothing in the directory is changed. A caller that continues the log holds its lock.

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
  /// Recover an older world: the newest version that is not above up_to_version, or whose time is not after
  /// up_to_time. Absent: the newest version.
  std::optional<Version> up_to_version = std::nullopt;
  std::optional<WorldTime> up_to_time = std::nullopt;
  /// Recovers a damaged log up to the version before the damage.
  bool salvage = false;
  /// Clock for `duration`; may be null.
  const Clock* clock = nullptr;
};

struct RecoveryReport {
  std::uint64_t database_id = 0;  ///< 0: there is no log yet
  std::uint64_t checkpoint = 0;   ///< number of the checkpoint used; 0: the empty world
  Version checkpoint_version = 0;
  Position read_from;  ///< position of the first group read
  /// A sentence for each newer checkpoint that is damaged or whose geometry files are.
  std::vector<std::string> damaged_checkpoints;
  ReadReport log;
  std::uint64_t versions = 0;  ///< number of versions applied from records
  /// The first gap after the checkpoint; the world is that before the gap. 0: no gap.
  Version gap_from = 0, gap_to = 0;
  /// The version that complete groups lead to. It is older than the world if reading ended within a group, or
  /// if the checkpoint is within a gap.
  Version version_of_groups = 0;
  Nanoseconds duration{0};

  /// One or more sentences: what was found, what was cut off and why.
  std::string describe() const;
};

struct Recovered {
  World world;
  RecoveryReport report;
  Listing listing;
};

/// Errors: file, for damage (with its place); an unknown format; files of another database; a damaged or
/// missing geometry file; a gap after which only a damaged checkpoint continues; and, with salvage too, a
/// read error of the disk.
Result<Recovered> recover(Disk& disk, const RecoveryOptions& options = {});

}  // namespace rtstdb::log
