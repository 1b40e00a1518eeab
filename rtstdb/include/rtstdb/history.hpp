#pragma once
// History: any query AS OF a past time or version that a log holds (durability.hpp), also after the process
// that wrote the log has ended, and while another process writes it. Nothing in the directory is changed.
//
// A history is a Database that holds a range of versions of a log: a first version and all later ones up to a
// last one. Transactions read it with ReadAt::pinned and ReadAt::as_of, as in a live database. Answers are
// those that the live database gave or would have given: the same versions, ids and rows, bit for bit.
// Versions that a live database still keeps can be read there, without a log.
//
// Differences from a live database:
//   - Transactions with writes are refused (RefusedBy::read_only), and so are add_geometry,
//     add_material and add_light.
//   - ReadAt::latest is the last version of the range.
//   - Reading AS OF a time that the last version does not cover, or may not cover, is refused
//     (BadInputReason::beyond_history). A query at a pinned version may have later times, as everywhere; its
//     answer follows from the motions known in that version.
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
  /// The log's directory.
  std::filesystem::path directory{};
  /// First and last version of the range, by number or by time (the version that covers it). ReadAt::latest:
  /// for `to` the last version of the log, for `from` the same version as `to`. Each row change in the range
  /// takes about 200 bytes of memory, each shape its positions.
  ReadAt from{};
  ReadAt to{};
  /// Reads a damaged log up to the version before the damage. The time of that version and later times cannot
  /// be read AS OF, since lost versions may cover them. False: a range that reaches the damage is refused.
  bool salvage = false;
  /// Device and validation as in DatabaseOptions.
  std::string gpu = "auto";
  Validation validation = Validation::build_default;
};

/// The versions that a log holds.
struct HistoryExtent {
  std::uint64_t database_id = 0;  ///< see Durability
  /// The first readable version: 0, the empty world, or the version of the oldest checkpoint if older
  /// segments were removed (DurabilityOptions::prune).
  VersionInfo first{};
  VersionInfo last{};
  std::uint64_t commits = 0;  ///< each makes one version
  struct Gap {
    Version first = 0, last = 0;
  };
  /// Versions that were not recorded because the disk was too slow. A range cannot span a gap.
  std::vector<Gap> gaps{};
  bool closed = false;   ///< the log was closed by close(): no version follows `last`
  std::string damage{};  ///< salvage: a sentence on the damage; empty: none
};

/// Reads the whole log and its meshes. `salvage`: as in HistoryOptions.
/// Errors: file for a directory without a log, for a read error, and for damage (with its place) unless
/// salvaged; out_of_memory.
Result<HistoryExtent> history_extent(const std::filesystem::path& directory, bool salvage = false);

/// Opens a range of a log as a database that cannot be written.
/// Errors: file and no_device as in Database::open; bad_input for a range that the log does not hold (the
/// message says what it holds), that spans a gap, or that ends before it begins; capacity for a range with
/// more row changes or shapes than a database can keep (max_retained_changes, max_retained_shapes);
/// out_of_memory.
Result<std::unique_ptr<Database>> open_history(const HistoryOptions& options);

}  // namespace rtstdb
