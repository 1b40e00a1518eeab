#include "rtstdb/log/log_replay.hpp"

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

class LogReplay final : public RecordVisitor {
 public:
  LogReplay(Disk& disk, const Listing& listing, std::uint64_t database_id, ReplayListener& listener)
      : disk_(disk), listing_(listing), database_id_(database_id), listener_(listener) {}

  void begin(World&& world) {
    now_ = std::move(world);
    first_version_ = now_.latest.version;
    listener_.world(now_);
  }

  const char* record(Record& record, const RecordPlace& place) override {
    if (record.kind == RecordKind::discarded) return discarded(record.version);
    pass_pending_commit();
    if (record.kind == RecordKind::commit) return commit(record.commit, place.segment);
    if (record.kind == RecordKind::geometry) return geometry(record.geometry);
    if (record.kind == RecordKind::material) return definition(record.material);
    if (record.kind == RecordKind::light) return definition(record.light);
    if (record.kind == RecordKind::gap) return gap({record.version, record.to});
    return "a record has an unknown kind";
  }
  /// End of the log: the last commit can no longer be discarded.
  void end() {
    pass_pending_commit();
    begin_next_world();
    report_unresolved();
  }

 private:
  void pass_pending_commit() {
    if (pending_commit_) listener_.commit(pending_commit_->set(), now_, segment_);
    pending_commit_.reset();
  }
  const char* commit(store::WriteSet& set, std::uint64_t segment) {
    if (next_ && set.version > next_->latest.version) begin_next_world();
    if (next_ || world_unknown_) {
      second_last_ = unresolved_range_.last;
      if (unresolved_commits_++ == 0) unresolved_range_.first = set.version;
      unresolved_range_.last = set.version;
      return nullptr;
    }
    if (set.version <= first_version_) return nullptr;
    if (const char* fault = now_.apply(set)) return fault;
    pending_commit_.emplace(set);
    segment_ = segment;
    return nullptr;
  }
  const char* discarded(Version version) {
    if (next_ || world_unknown_) {
      if (unresolved_commits_ > 0 && version == unresolved_range_.last) {
        --unresolved_commits_;
        unresolved_range_.last = second_last_;
      }
      return nullptr;
    }
    if (version <= first_version_) return nullptr;
    pending_commit_.reset();
    return now_.discard(version);
  }
  const char* geometry(const LoggedGeometry& geometry) {
    if (world_unknown_ || (next_ && next_->knows(geometry.id))) return nullptr;
    begin_next_world();
    if (now_.knows(geometry.id)) return now_.add(geometry, {});
    auto mesh = read_geometry_file(disk_, database_id_, geometry.file, geometry.file_checksum);
    if (!mesh) return keep(mesh.error().message);
    if (const char* fault = now_.add(geometry, std::move(mesh).value())) return fault;
    listener_.geometry(now_.geometries[geometry.id.index]);
    return nullptr;
  }
  template <class Value>
  const char* definition(const LoggedDefinition<Value>& definition) {
    if (world_unknown_ || (next_ && next_->knows(definition.id))) return nullptr;
    begin_next_world();
    const bool known = now_.knows(definition.id);
    if (const char* fault = now_.add(definition)) return fault;
    if (!known) report(definition);
    return nullptr;
  }
  void report(const LoggedMaterial& material) { listener_.material(material); }
  void report(const LoggedLight& light) { listener_.light(light); }
  const char* gap(const Gap& gap) {
    if (next_ && gap.last > next_->latest.version) begin_next_world();
    if (!next_ && !world_unknown_ && gap.last <= first_version_) return nullptr;
    report_unresolved();
    listener_.gap(gap);
    if (next_ || world_unknown_) return nullptr;
    auto checkpoint = checkpoint_from(disk_, listing_, gap.last);
    if (!checkpoint) return keep(checkpoint.error().message);
    world_unknown_ = !checkpoint.value().has_value();
    if (!world_unknown_) next_ = std::move(checkpoint.value()->world);
    return nullptr;
  }
  /// Continues with the world after a gap, if there is one.
  void begin_next_world() {
    if (!next_) return;
    report_unresolved();
    begin(std::move(*std::exchange(next_, std::nullopt)));
  }
  void report_unresolved() {
    if (unresolved_commits_ > 0) listener_.unresolved(unresolved_range_, unresolved_commits_);
    unresolved_commits_ = 0;
  }
  const char* keep(std::string fault) {
    fault_ = std::move(fault);
    return fault_.c_str();
  }

  Disk& disk_;
  const Listing& listing_;
  std::uint64_t database_id_;
  ReplayListener& listener_;
  World now_;
  Version first_version_ = 0;
  std::optional<World> next_;   // after a gap: the world with which the history continues
  bool world_unknown_ = false;  // after a gap without such a world
  Gap unresolved_range_{};      // range of the commits whose world is unknown
  Version second_last_ = 0;     // the last but one of them
  std::uint64_t unresolved_commits_ = 0;
  std::optional<OwnedCommit> pending_commit_;
  std::uint64_t segment_ = 0;  // segment of `pending_commit_`
  std::string fault_;
};

}  // namespace

Result<ReadReport> replay_log(Disk& disk, bool salvage, ReplayListener& listener) {
  auto listing = list_log(disk);
  if (!listing) return Error{ErrorCode::file, listing.error().describe()};
  const auto& segments = listing.value().segments;
  auto database_id = database_id_of(disk, segments);
  if (!database_id) return database_id.error();
  ReadOptions options{
      .database_id = database_id.value(), .from = {}, .previous_time = {}, .salvage = salvage};
  auto chain = find_chain(disk, segments, options.database_id, options.from);
  if (!chain) return chain.error();
  World world;
  if (chain.value().links.empty() || !chain.value().damage_before.empty()) {
    auto checkpoint = checkpoint_from(disk, listing.value(), 0);
    if (!checkpoint) return checkpoint.error();
    if (checkpoint.value()) {
      options.database_id = checkpoint.value()->header.database_id;
      options.from = checkpoint.value()->position();
      options.previous_time = checkpoint.value()->world.time();
      world = std::move(checkpoint.value()->world);
    }
  }
  if (options.database_id == 0) return Error{ErrorCode::file, "there is no log of a database"};
  LogReplay replay(disk, listing.value(), options.database_id, listener);
  replay.begin(std::move(world));
  auto report = read_log(disk, segments, options, replay);
  replay.end();
  if (report) report.value().database_id = options.database_id;
  return report;
}

}  // namespace rtstdb::log
