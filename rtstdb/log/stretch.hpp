#pragma once
// A stretch of the past as a log tells of it: the world as one version left it, and the commits behind that one. It changes nothing in
// the directory, and needs no right to write there: it reads beside whoever has it.

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

/// A commit with memory of its own.
class KeptCommit {
 public:
  explicit KeptCommit(const store::WriteSet& set);
  /// Its shapes point into this.
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

/// What a log tells of, without its worlds.
struct Extent {
  std::uint64_t database_id = 0;  ///< 0: there is no database yet
  /// From this one on worlds can be had: the empty one, or that of the oldest checkpoint where older segments are gone.
  VersionInfo first;
  VersionInfo last;
  std::uint64_t commits = 0;  ///< in the segments
  std::vector<Gap> gaps;
  LogEnd end = LogEnd::end_of_data;
  std::string damage;  ///< salvage alone
};
/// Errors: file, as recover.
Result<Extent> read_extent(Disk& disk, bool salvage);

struct Stretch {
  World begin;  ///< with the geometries of the whole stretch
  /// By version; the first comes right after `begin`.
  std::vector<KeptCommit> commits;
  /// When the version behind the stretch begins; none: the log has none.
  std::optional<WorldTime> ends;

  VersionInfo last() const noexcept {
    return commits.empty() ? begin.latest
                           : VersionInfo{commits.back().set().version, commits.back().set().time};
  }
};

/// From the version that `from` names to the one that `to` names; latest is the log's last. Errors: file, as recover, and where a gap
/// lies within; bad_input for what the log does not have, with what it has, and for `to` before `from`.
Result<Stretch> read_stretch(Disk& disk, const ReadAt& from, const ReadAt& to, bool salvage);

/// A store that has lived through nothing yet, and has room, lives through it.
void live_through(Stretch& stretch, store::Store& store);

}  // namespace rtstdb::log
