#pragma once
// All that a log tells, from the first world that can be had to the last, as one history: commits that were taken back are left out,
// and behind versions that are missing it goes on with the first checkpoint that knows the world again. It changes nothing in the
// directory.

#include <cstdint>

#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/reader.hpp"
#include "rtstdb/log/stretch.hpp"
#include "rtstdb/log/world.hpp"

namespace rtstdb::log {

/// Told in the order of versions.
class ChronicleListener {
 public:
  virtual ~ChronicleListener() = default;
  /// What the history begins with, and what it goes on with behind a gap.
  virtual void world(const World& world) = 0;
  /// Added to the world that was told of.
  virtual void geometry(const WorldGeometry& geometry) = 0;
  /// `now`: the world that it left. `segment`: where it stands.
  virtual void commit(const store::WriteSet& set, const World& now, std::uint64_t segment) = 0;
  /// The log says that these were not recorded. Up to the next world, or to the end, nothing can be said of the world.
  virtual void gap(const Gap& gap) = 0;
  /// Behind a gap, before the next world: so many commits between these versions were recorded, and there is no world to add them to.
  virtual void unresolved(const Gap& between, std::uint64_t commits) = 0;
};

/// Errors: file, as recover; with `salvage` damage ends the history and is told in the report.
Result<ReadReport> read_chronicle(Disk& disk, bool salvage, ChronicleListener& listener);

}  // namespace rtstdb::log
