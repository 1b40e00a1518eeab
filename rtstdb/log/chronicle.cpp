#include "rtstdb/log/chronicle.hpp"

#include <optional>
#include <string>
#include <utility>

#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/geometry_file.hpp"
#include "rtstdb/log/segment_chain.hpp"

namespace rtstdb::log {
namespace {

/// The oldest undamaged checkpoint whose version is at least `not_before`, with its meshes.
Result<std::optional<Checkpoint>> checkpoint_from(Disk& disk, const Listing& listing, Version not_before) {
  auto checkpoint = oldest_checkpoint(disk, listing, not_before);
  if (!checkpoint) return checkpoint;
  if (auto read = read_meshes(disk, checkpoint->header.database_id, checkpoint->world); !read)
    return read.error();
  return checkpoint;
}

class Following final : public RecordVisitor {
 public:
  Following(Disk& disk, const Listing& listing, std::uint64_t database_id, ChronicleListener& listener)
      : disk_(disk), listing_(listing), database_id_(database_id), listener_(listener) {}

  void begin(World&& world) {
    now_ = std::move(world);
    begun_with_ = now_.latest.version;
    listener_.world(now_);
  }

  const char* record(Record& record, const RecordPlace& place) override {
    if (record.kind == RecordKind::taken_back) return taken_back(record.version);
    tell();
    if (record.kind == RecordKind::commit) return commit(record.commit, place.segment);
    if (record.kind == RecordKind::geometry) return geometry(record.geometry);
    if (record.kind == RecordKind::gap) return gap({record.version, record.to});
    return "a record is of no known kind";
  }
  /// End of the log: the last commit can no longer be taken back.
  void end() {
    tell();
    arrive();
    tell_of_untold();
  }

 private:
  void tell() {
    if (untold_) listener_.commit(untold_->set(), now_, segment_);
    untold_.reset();
  }
  const char* commit(store::WriteSet& set, std::uint64_t segment) {
    if (next_ && set.version > next_->latest.version) arrive();
    if (next_ || lost_) {
      before_last_ = behind_gap_.last;
      if (commits_behind_gap_++ == 0) behind_gap_.first = set.version;
      behind_gap_.last = set.version;
      return nullptr;
    }
    if (set.version <= begun_with_) return nullptr;
    if (const char* fault = now_.apply(set)) return fault;
    untold_.emplace(set);
    segment_ = segment;
    return nullptr;
  }
  const char* taken_back(Version version) {
    if (next_ || lost_) {
      if (commits_behind_gap_ > 0 && version == behind_gap_.last) {
        --commits_behind_gap_;
        behind_gap_.last = before_last_;
      }
      return nullptr;
    }
    if (version <= begun_with_) return nullptr;
    untold_.reset();
    return now_.take_back(version);
  }
  const char* geometry(const LoggedGeometry& geometry) {
    if (lost_ || (next_ && next_->knows(geometry.id))) return nullptr;
    arrive();
    if (now_.knows(geometry.id)) return now_.add(geometry, {});
    auto mesh = read_geometry_file(disk_, database_id_, geometry.file, geometry.file_checksum);
    if (!mesh) return keep(mesh.error().message);
    if (const char* fault = now_.add(geometry, std::move(mesh).value())) return fault;
    listener_.geometry(now_.geometries[geometry.id.index]);
    return nullptr;
  }
  const char* gap(const Gap& gap) {
    if (next_ && gap.last > next_->latest.version) arrive();
    if (!next_ && !lost_ && gap.last <= begun_with_) return nullptr;
    tell_of_untold();
    listener_.gap(gap);
    if (next_ || lost_) return nullptr;
    auto checkpoint = checkpoint_from(disk_, listing_, gap.last);
    if (!checkpoint) return keep(checkpoint.error().message);
    lost_ = !checkpoint.value().has_value();
    if (!lost_) next_ = std::move(checkpoint.value()->world);
    return nullptr;
  }
  /// Continues with the world after a gap, if there is one.
  void arrive() {
    if (!next_) return;
    tell_of_untold();
    begin(std::move(*std::exchange(next_, std::nullopt)));
  }
  void tell_of_untold() {
    if (commits_behind_gap_ > 0) listener_.unresolved(behind_gap_, commits_behind_gap_);
    commits_behind_gap_ = 0;
  }
  const char* keep(std::string fault) {
    fault_ = std::move(fault);
    return fault_.c_str();
  }

  Disk& disk_;
  const Listing& listing_;
  std::uint64_t database_id_;
  ChronicleListener& listener_;
  World now_;
  Version begun_with_ = 0;
  std::optional<World> next_;  // after a gap: the world with which the history continues
  bool lost_ = false;          // after a gap without such a world
  Gap behind_gap_{};           // range of the commits whose world is unknown
  Version before_last_ = 0;    // the last but one of them
  std::uint64_t commits_behind_gap_ = 0;
  std::optional<KeptCommit> untold_;
  std::uint64_t segment_ = 0;  // segment of `untold_`
  std::string fault_;
};

}  // namespace

Result<ReadReport> read_chronicle(Disk& disk, bool salvage, ChronicleListener& listener) {
  auto listing = list_log(disk);
  if (!listing) return Error{ErrorCode::file, listing.error().in_words()};
  const auto& segments = listing.value().segments;
  auto database_id = database_id_of(disk, segments);
  if (!database_id) return database_id.error();
  ReadOptions options{.database_id = database_id.value(), .from = {}, .time_before = {}, .salvage = salvage};
  auto chain = find_chain(disk, segments, options.database_id, options.from);
  if (!chain) return chain.error();
  World world;
  if (chain.value().links.empty() || !chain.value().damage_before.empty()) {
    auto checkpoint = checkpoint_from(disk, listing.value(), 0);
    if (!checkpoint) return checkpoint.error();
    if (checkpoint.value()) {
      options.database_id = checkpoint.value()->header.database_id;
      options.from = checkpoint.value()->position();
      options.time_before = checkpoint.value()->world.time();
      world = std::move(checkpoint.value()->world);
    }
  }
  if (options.database_id == 0) return Error{ErrorCode::file, "there is no database's log"};
  Following following(disk, listing.value(), options.database_id, listener);
  following.begin(std::move(world));
  auto report = read_log(disk, segments, options, following);
  following.end();
  if (report) report.value().database_id = options.database_id;
  return report;
}

}  // namespace rtstdb::log
