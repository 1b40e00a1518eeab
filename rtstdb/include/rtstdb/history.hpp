#pragma once
// The past of a world that has a log (durability.hpp): any query as of any time or version that the log tells of, also long after the
// process that wrote it has ended, and beside one that is writing it. Nothing in the directory is changed.
//
// A history is a Database that holds a stretch of the past: a version and all that came behind it up to another one. Transactions ask
// it as they ask any, at ReadAt::pinned and ReadAt::as_of; answers are those that were given then, or would have been given: the same
// versions, ids and rows, bit for bit. What a live database still keeps is asked for there, without a log.
//
// What differs: whatever writes is refused (RefusedBy::read_only), and so is add_geometry. ReadAt::latest is the stretch's last version.
// Reading as of a time at which that did not hold any more, or may not have, is refused (BadInputReason::beyond_history); a query pinned to a version may ask
// at later times, as everywhere, and is answered by the motions that were known then.
//
// Threads: both functions are setup: they read files, allocate and block.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb {

struct HistoryOptions {
  /// Where the log is.
  std::filesystem::path directory{};
  /// The stretch: the version that was the latest at a time, or a numbered one; ReadAt::latest is the log's last for `to`, and for
  /// `from` the same as `to`. Each row change in it takes about 200 bytes of memory, each shape its positions.
  ReadAt from{};
  ReadAt to{};
  /// A damaged log is read up to the version before the damage; of its time and later ones nothing can be asked AS OF, for what comes
  /// behind may be of the same time. Else a stretch that comes to the damage is refused.
  bool salvage = false;
  /// As in DatabaseOptions.
  std::string gpu = "auto";
  Validation validation = Validation::build_default;
};

/// What a log tells of.
struct HistoryExtent {
  std::uint64_t database_id = 0;  ///< see Durability
  /// The first version that can be had: 0, the empty world, or that of the oldest checkpoint where older segments were taken away.
  VersionInfo first{};
  VersionInfo last{};
  std::uint64_t commits = 0;  ///< each with a version of its own
  struct Gap {
    Version first = 0, last = 0;
  };
  /// Versions that were not recorded, since the disk was slower than they came. No stretch leads over them.
  std::vector<Gap> gaps{};
  bool closed = false;   ///< the log was ended on purpose: nothing came behind `last`
  std::string damage{};  ///< salvage: what is wrong, in words; empty: nothing
};

/// Reads the whole log and its meshes, but not its worlds. Errors: file for a directory without a database, and for what a recovery refuses (damage,
/// with its place); out_of_memory.
Result<HistoryExtent> history_extent(const std::filesystem::path& directory, bool salvage = false);

/// Errors: file and no_device as Database::open has them; bad_input for a stretch that is not in the log (with what it has), leads over a
/// gap, or ends before it begins; capacity for one with more changes or shapes than a database can keep (max_retained_changes,
/// max_kept_shapes).
Result<std::unique_ptr<Database>> open_history(const HistoryOptions& options);

}  // namespace rtstdb
