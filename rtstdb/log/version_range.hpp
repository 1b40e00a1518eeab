#pragma once
// Reads a range of versions from a log: the world at the first version, and the commits after it. Nothing in
// the directory is changed; no lock is needed, and another process may be writing the log.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <rtstdb/result.hpp>
#include <rtstdb/transaction.hpp>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/reader.hpp"
#include "rtstdb/log/world.hpp"

namespace rtstdb::log {

/// A commit that owns the memory of its shapes.
class OwnedCommit {
 public:
  explicit OwnedCommit(const store::WriteSet& set);
  /// Its shapes point into this object.
  store::WriteSet& set() noexcept { return set_; }
  const store::WriteSet& set() const noexcept { return set_; }

 private:
  store::WriteSet set_;
  std::vector<std::vector<glm::vec3>> positions_m_;  // by shape
};

/// Versions that are not in the log.
struct Gap {
  Version first = 0, last = 0;
};

/// The versions that a log holds.
struct Extent {
  std::uint64_t database_id = 0;  ///< 0: there is no log yet
  /// The first readable world: the empty one, or that of the oldest checkpoint if older segments were
  /// removed.
  VersionInfo first;
  VersionInfo last;
  std::uint64_t commits = 0;  ///< number of commits in the segments
  std::vector<Gap> gaps;
  LogEnd end = LogEnd::end_of_data;
  std::string damage;  ///< only with salvage
};
/// Errors: file, as in recover.
Result<Extent> read_extent(Disk& disk, bool salvage);

struct VersionRange {
  World begin;  ///< with all geometries, materials and lights of the range
  /// In the order of versions; the first follows `begin`.
  std::vector<OwnedCommit> commits;
  /// The time of the version after the range; none: the log has no later version.
  std::optional<WorldTime> ends;

  VersionInfo last() const noexcept {
    return commits.empty() ? begin.latest
                           : VersionInfo{commits.back().set().version, commits.back().set().time};
  }
};

/// Reads the range from `from` to `to`; ReadAt::latest is the last version of the log. Errors: file, as in
/// recover; bad_input for a version or time that the log does not hold (the message says what it holds), for
/// a range that spans a gap, and for `to` before `from`.
Result<VersionRange> read_version_range(Disk& disk, const ReadAt& from, const ReadAt& to, bool salvage);

/// Applies the range to an empty store with enough capacity.
void apply_range(VersionRange& range, store::Store& store);

}  // namespace rtstdb::log
