#pragma once
// Reads a whole log as one history, from the first readable world to the last. Versions that were discarded
// are omitted. After a gap it continues with the first checkpoint after the gap. Nothing in the directory is
// changed.

#include <cstdint>

#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/reader.hpp"
#include "rtstdb/log/version_range.hpp"
#include "rtstdb/log/world.hpp"

namespace rtstdb::log {

/// Receives the history in the order of versions.
class ReplayListener {
 public:
  virtual ~ReplayListener() = default;
  /// The world at which the history begins, and the one with which it continues after a gap.
  virtual void world(const World& world) = 0;
  /// A geometry was added to the current world.
  virtual void geometry(const WorldGeometry& geometry) = 0;
  /// A material was added to the current world.
  virtual void material(const LoggedMaterial& material) = 0;
  /// A light was added to the current world.
  virtual void light(const LoggedLight& light) = 0;
  /// `now`: the world after the commit. `segment`: the segment of its record.
  virtual void commit(const store::WriteSet& set, const World& now, std::uint64_t segment) = 0;
  /// These versions were not recorded. The world is unknown up to the next call of `world`, or to the end.
  virtual void gap(const Gap& gap) = 0;
  /// After a gap and before the next world: number of recorded commits in this range, whose world is unknown.
  virtual void unresolved(const Gap& between, std::uint64_t commits) = 0;
};

/// Errors: file, as in recover. With `salvage`, damage ends the history and is described in the report.
Result<ReadReport> replay_log(Disk& disk, bool salvage, ReplayListener& listener);

}  // namespace rtstdb::log
