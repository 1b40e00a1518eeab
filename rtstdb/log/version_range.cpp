#include "rtstdb/log/version_range.hpp"

#include <algorithm>
#include <utility>

#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/geometry_file.hpp"
#include "rtstdb/log/recovery.hpp"
#include "rtstdb/log/segment_chain.hpp"

namespace rtstdb::log {
namespace {

constexpr VersionInfo empty_world{0, world_time_ns(-max_world_time_ns)};

std::string describe(const VersionInfo& version) {
  if (version.version == 0) return "version 0, the empty world";
  return "version " + std::to_string(version.version) + " of " +
         std::to_string(seconds_between(WorldTime{}, version.time)) + " s";
}

std::string describe(const Gap& gap) {
  return "versions " + std::to_string(gap.first) + " to " + std::to_string(gap.last) + " are not in the log";
}

/// Determines the extent of a log record by record. Meshes are read too, since a missing mesh makes all later
/// versions unreadable.
class ExtentReader final : public RecordVisitor {
 public:
  ExtentReader(Disk& disk, Extent& extent)
      : disk_(disk), extent_(extent), first_version_(extent.first.version) {}
  const char* record(Record& record, const RecordPlace&) override {
    if (record.kind == RecordKind::geometry) {
      const LoggedGeometry& geometry = record.geometry;
      auto mesh = read_geometry_file(disk_, extent_.database_id, geometry.file, geometry.file_checksum);
      if (mesh) return nullptr;
      fault_ = mesh.error().message;
      return fault_.c_str();
    }
    if (record.kind == RecordKind::commit) {
      ++extent_.commits;
      before_ = extent_.last;
      if (record.commit.version > first_version_) extent_.last = {record.commit.version, record.commit.time};
    } else if (record.kind == RecordKind::discarded) {
      --extent_.commits;
      if (record.version == extent_.last.version) extent_.last = before_;
    } else if (record.kind == RecordKind::gap && record.to > first_version_) {
      extent_.gaps.push_back({record.version, record.to});
    }
    return nullptr;
  }

 private:
  Disk& disk_;
  Extent& extent_;
  Version first_version_;
  VersionInfo before_;
  std::string fault_;
};

/// The oldest undamaged checkpoint with its meshes; none: there is none.
std::optional<Checkpoint> oldest_world(Disk& disk, const Listing& listing) {
  auto oldest = oldest_checkpoint(disk, listing, 0);
  while (oldest && !read_meshes(disk, oldest->header.database_id, oldest->world))
    oldest = oldest_checkpoint(disk, listing, oldest->world.latest.version + 1);
  return oldest;
}

/// Collects the commits after a world and checks each one against it.
class RangeReader final : public RecordVisitor {
 public:
  RangeReader(Disk& disk, std::uint64_t database_id, const ReadAt& to, VersionRange& range)
      : disk_(disk), database_id_(database_id), to_(to), stretch_(range), now_(range.begin) {}

  const char* record(Record& record, const RecordPlace&) override {
    if (stretch_.ends) {
      // The version after the range may still be discarded.
      is_done_ = record.kind != RecordKind::discarded || record.version != beyond_;
      if (!is_done_) stretch_.ends.reset();
      return nullptr;
    }
    switch (record.kind) {
      case RecordKind::commit:
        return commit(record.commit);
      case RecordKind::geometry:
        return geometry(record.geometry);
      case RecordKind::material:
        return definition(record.material);
      case RecordKind::light:
        return definition(record.light);
      case RecordKind::discarded:
        return discarded(record.version);
      case RecordKind::gap:
        return on_gap(Gap{record.version, record.to});
      case RecordKind::move:  // decoded as a commit
      case RecordKind::none:
        break;
    }
    return "a record has an unknown kind";
  }
  bool is_done() const override { return is_done_; }
  /// A gap within the range.
  const std::optional<Gap>& gap() const noexcept { return gap_; }

 private:
  Version first_version() const noexcept { return stretch_.begin.latest.version; }

  const char* commit(store::WriteSet& set) {
    if (set.version <= first_version()) return nullptr;
    const bool beyond = to_.kind == ReadAt::Kind::version
                            ? set.version > to_.version
                            : to_.kind == ReadAt::Kind::time && set.time > to_.time;
    if (beyond) {
      beyond_ = set.version;
      stretch_.ends = set.time;
      return nullptr;
    }
    if (const char* fault = now_.apply(set)) return fault;
    stretch_.commits.emplace_back(set);
    return nullptr;
  }
  const char* discarded(Version version) {
    if (version <= first_version()) return nullptr;
    if (const char* fault = now_.discard(version)) return fault;
    stretch_.commits.pop_back();
    return nullptr;
  }
  const char* geometry(const LoggedGeometry& geometry) {
    StoredMesh mesh;
    if (!now_.knows(geometry.id)) {
      auto read = read_geometry_file(disk_, database_id_, geometry.file, geometry.file_checksum);
      if (!read) {
        fault_ = read.error().message;
        return fault_.c_str();
      }
      mesh = std::move(read).value();
      StoredMesh copy = mesh;
      if (const char* fault = stretch_.begin.add(geometry, std::move(copy))) return fault;
    }
    return now_.add(geometry, std::move(mesh));
  }
  template <class Value>
  const char* definition(const LoggedDefinition<Value>& definition) {
    if (const char* fault = stretch_.begin.add(definition)) return fault;
    return now_.add(definition);
  }
  const char* on_gap(const Gap& gap) {
    if (gap.last <= first_version()) return nullptr;
    is_done_ = true;
    const bool before_it = (to_.kind == ReadAt::Kind::version && to_.version < gap.first) ||
                           (to_.kind == ReadAt::Kind::time && to_.time < now_.latest.time);
    if (!before_it) gap_ = gap;
    // The time of the version after the gap is unknown; it may be the same time.
    stretch_.ends = now_.latest.time;
    return nullptr;
  }

  Disk& disk_;
  std::uint64_t database_id_;
  const ReadAt& to_;
  VersionRange& stretch_;
  World now_;
  Version beyond_ = 0;
  bool is_done_ = false;
  std::optional<Gap> gap_;
  std::string fault_;
};

Error not_there(const std::string& what, Disk& disk, bool salvage) {
  const auto extent = read_extent(disk, salvage);
  std::string has;
  if (extent)
    has = "; the log has " + describe(extent.value().first) + ", to " + describe(extent.value().last);
  return {ErrorCode::bad_input, what + " is not in the log" + has};
}

std::string describe(const ReadAt& read_at) {
  if (read_at.kind == ReadAt::Kind::version) return "version " + std::to_string(read_at.version);
  if (read_at.kind == ReadAt::Kind::time)
    return "the world at " + std::to_string(seconds_between(WorldTime{}, read_at.time)) + " s";
  return "the latest version";
}

RecoveryOptions up_to(const ReadAt& read_at, bool salvage) {
  RecoveryOptions options{.salvage = salvage};
  if (read_at.kind == ReadAt::Kind::version) options.up_to_version = read_at.version;
  if (read_at.kind == ReadAt::Kind::time) options.up_to_time = read_at.time;
  return options;
}

}  // namespace

OwnedCommit::OwnedCommit(const store::WriteSet& set) : set_(set) {
  for (store::ShapeWrite& shape : set_.shapes) {
    // Moving a vector keeps the address of its elements.
    positions_m_.emplace_back(shape.positions_m.begin(), shape.positions_m.end());
    shape.positions_m = positions_m_.back();
  }
}

Result<Extent> read_extent(Disk& disk, bool salvage) {
  auto listing = list_log(disk);
  if (!listing) return Error{ErrorCode::file, listing.error().describe()};
  const auto& segments = listing.value().segments;
  auto database_id = database_id_of(disk, segments);
  if (!database_id) return database_id.error();
  Extent extent;
  extent.database_id = database_id.value();
  extent.first = extent.last = empty_world;

  ReadOptions options{.database_id = extent.database_id, .from = {}, .previous_time = {}, .salvage = salvage};
  auto chain = find_chain(disk, segments, extent.database_id, options.from);
  if (!chain) return chain.error();
  if (chain.value().links.empty() || !chain.value().damage_before.empty()) {
    if (const auto oldest = oldest_world(disk, listing.value())) {
      extent.database_id = options.database_id = oldest->header.database_id;
      extent.first = extent.last = oldest->world.latest;
      options.from = oldest->position();
      options.previous_time = oldest->world.time();
    }
  }
  ExtentReader reader(disk, extent);
  auto read = read_log(disk, segments, options, reader);
  if (!read) return read.error();
  extent.end = read.value().end;
  extent.damage = read.value().damage;
  return extent;
}

Result<VersionRange> read_version_range(Disk& disk, const ReadAt& from, const ReadAt& to, bool salvage) {
  const ReadAt& begin = from.kind == ReadAt::Kind::latest ? to : from;
  auto recovered = recover(disk, up_to(begin, salvage));
  if (!recovered) {
    // A world before the oldest checkpoint is bad input; any other error is that of the recovery.
    auto extent = read_extent(disk, salvage);
    if (!extent || extent.value().first.version == 0) return recovered.error();
    const VersionInfo& first = extent.value().first;
    const bool before = begin.kind == ReadAt::Kind::version
                            ? begin.version < first.version
                            : begin.kind == ReadAt::Kind::time && begin.time < first.time;
    return before ? not_there(describe(begin), disk, salvage) : recovered.error();
  }
  const RecoveryReport& report = recovered.value().report;
  if (report.database_id == 0) return Error{ErrorCode::bad_input, "there is no database"};
  const VersionInfo found = recovered.value().world.latest;
  const Gap gap{report.gap_from, report.gap_to};
  if (gap.first != 0 && begin.kind == ReadAt::Kind::version && begin.version >= gap.first &&
      begin.version <= gap.last)
    return not_there(describe(begin), disk, salvage);
  const bool may_lie_in_gap = gap.first > found.version && begin.kind != ReadAt::Kind::version;
  if (begin.kind == ReadAt::Kind::time && may_lie_in_gap)
    return Error{ErrorCode::bad_input,
                 describe(begin) + " is not in the log: after " + describe(found) + ", " + describe(gap)};
  if (begin.kind == ReadAt::Kind::version && found.version != begin.version)
    return not_there(describe(begin), disk, salvage);
  if (begin.kind == ReadAt::Kind::time && !report.log.damage.empty())
    return Error{ErrorCode::bad_input,
                 describe(begin) + " is not in the log: after " + describe(found) + ", " + report.log.damage};

  VersionRange range{.begin = std::move(recovered.value().world), .commits = {}, .ends = {}};
  RangeReader reader(disk, report.database_id, to, range);
  auto read = read_log(disk, recovered.value().listing.segments,
                       {.database_id = report.database_id,
                        .from = report.read_from,
                        .previous_time = range.begin.time(),
                        .salvage = salvage},
                       reader);
  if (!read) return read.error();
  // Damage: whether a later version follows, and at what time, is unknown; it may be the time of the last
  // one.
  if (!read.value().damage.empty()) range.ends = range.last().time;
  if (reader.gap())
    return Error{ErrorCode::bad_input,
                 "from " + describe(found) + " to " + describe(to) + ": " + describe(*reader.gap())};
  const bool backwards = (to.kind == ReadAt::Kind::version && to.version < found.version) ||
                         (to.kind == ReadAt::Kind::time && to.time < found.time);
  if (backwards)
    return Error{ErrorCode::bad_input,
                 describe(to) + " is before " + describe(found) + ", the beginning of the range"};
  if (to.kind == ReadAt::Kind::version && range.last().version != to.version)
    return not_there(describe(to), disk, salvage);
  return range;
}

void apply_range(VersionRange& range, store::Store& store) {
  range.begin.restore(store);
  for (OwnedCommit& commit : range.commits) {
    store.restage(commit.set());
    store.publish();
    store.complete_commit();
  }
  if (range.ends) store.end_history_at(*range.ends);
}

}  // namespace rtstdb::log
