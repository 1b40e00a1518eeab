#include "rtstdb/log/recovery.hpp"

#include <utility>

#include "rtstdb/geometry/counted.hpp"
#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/geometry_file.hpp"
#include "rtstdb/log/segment_chain.hpp"

namespace rtstdb::log {
namespace {

/// Applies records to a world, up to the requested version or time, or to the first gap.
class Replay final : public RecordVisitor {
 public:
  Replay(Disk& disk, const RecoveryOptions& options, Recovered& recovered)
      : disk_(disk),
        options_(options),
        recovered_(recovered),
        first_version_(recovered.world.latest.version) {}

  const char* record(Record& record, const RecordPlace& place) override {
    // The checkpoint already contains the groups before its position.
    if (place.group->number < recovered_.report.read_from.group) return nullptr;
    if (place.group->number != group_) {
      group_ = place.group->number;
      version_before_group_ = recovered_.world.latest.version;
    }
    if (beyond_ != 0) {
      // The version beyond the limit may be discarded; then a later one may still be within it.
      is_done_ = record.kind != RecordKind::discarded || record.version != beyond_;
      if (!is_done_) beyond_ = 0;
      return nullptr;
    }
    switch (record.kind) {
      case RecordKind::commit:
        return commit(record.commit);
      case RecordKind::geometry:
        return geometry(record.geometry);
      case RecordKind::material:
        return recovered_.world.add(record.material);
      case RecordKind::light:
        return recovered_.world.add(record.light);
      case RecordKind::discarded:
        return discarded(record.version);
      case RecordKind::gap:
        return gap(record);
      case RecordKind::move:  // decoded as a commit
      case RecordKind::none:
        break;
    }
    return "a record has an unknown kind";
  }
  bool is_done() const override { return is_done_; }
  /// A read error of a geometry file, which does not mean that the log is damaged.
  const std::optional<Error>& unreadable() const { return unreadable_; }

  Version version_of_groups() const {
    // The checkpoint may be within the gap.
    const RecoveryReport& report = recovered_.report;
    if (report.gap_from != 0 && report.gap_from <= recovered_.world.latest.version)
      return report.gap_from - 1;
    const auto& last = report.log.last;
    const bool whole = group_ == 0 || (last && last->group == group_);
    return whole ? recovered_.world.latest.version : version_before_group_;
  }

 private:
  const char* commit(store::WriteSet& set) {
    if (set.version <= first_version_) return nullptr;
    if ((options_.up_to_version && set.version > *options_.up_to_version) ||
        (options_.up_to_time && set.time > *options_.up_to_time)) {
      beyond_ = set.version;
      return nullptr;
    }
    ++recovered_.report.versions;
    return recovered_.world.apply(set);
  }
  const char* discarded(Version version) {
    if (version <= first_version_) return nullptr;
    --recovered_.report.versions;
    return recovered_.world.discard(version);
  }
  const char* geometry(const LoggedGeometry& geometry) {
    StoredMesh mesh;
    if (!recovered_.world.knows(geometry.id)) {
      bool unreadable = false;
      auto read = read_geometry_file(disk_, recovered_.report.database_id, geometry.file,
                                     geometry.file_checksum, &unreadable);
      if (!read) {
        if (unreadable) unreadable_ = read.error();
        fault_ = read.error().message;
        return fault_.c_str();
      }
      mesh = std::move(read).value();
    }
    return recovered_.world.add(geometry, std::move(mesh));
  }
  const char* gap(const Record& record) {
    if (record.to <= first_version_) return nullptr;
    is_done_ = true;
    if (options_.up_to_version && record.version > *options_.up_to_version) return nullptr;
    recovered_.report.gap_from = record.version;
    recovered_.report.gap_to = record.to;
    return nullptr;
  }

  Disk& disk_;
  const RecoveryOptions& options_;
  Recovered& recovered_;
  Version first_version_;
  Version beyond_ = 0;  // a version found beyond the requested one
  bool is_done_ = false;
  std::uint64_t group_ = 0;
  Version version_before_group_ = 0;
  std::string fault_;
  std::optional<Error> unreadable_;
};

bool is_within(const CheckpointHeader& header, const RecoveryOptions& options) {
  if (options.up_to_version && header.version > *options.up_to_version) return false;
  return !options.up_to_time || world_time_ns(header.world_time_ns) <= *options.up_to_time;
}

/// Reads a checkpoint with its meshes.
Result<Checkpoint> read_world(Disk& disk, std::uint64_t number, std::uint64_t database_id) {
  auto checkpoint = read_checkpoint(disk, number, database_id);
  if (!checkpoint) return checkpoint;
  auto read = read_meshes(disk, database_id, checkpoint.value().world);
  if (!read) return Error{ErrorCode::file, checkpoint_name(number) + ": " + read.error().message};
  return checkpoint;
}

/// Reads the newest undamaged checkpoint that is not newer than requested into `recovered`. Returns the
/// position after it.
Result<Position> begin_from_checkpoint(Disk& disk, const RecoveryOptions& options, Recovered& recovered) {
  RecoveryReport& report = recovered.report;
  const auto& numbers = recovered.listing.checkpoints;
  for (auto number = numbers.rbegin(); number != numbers.rend(); ++number) {
    auto header = read_checkpoint_header(disk, *number);
    if (header && report.database_id != 0 && header.value().database_id != report.database_id)
      return Error{ErrorCode::file, checkpoint_name(*number) + ": it belongs to another database"};
    if (header && !is_within(header.value(), options)) continue;
    auto checkpoint =
        header ? read_world(disk, *number, header.value().database_id) : Result<Checkpoint>(header.error());
    if (!checkpoint) {
      report.damaged_checkpoints.push_back(checkpoint.error().message);
      continue;
    }
    report.database_id = checkpoint.value().header.database_id;
    report.checkpoint = *number;
    report.checkpoint_version = checkpoint.value().header.version;
    recovered.world = std::move(checkpoint.value().world);
    return checkpoint.value().position();
  }
  return Position{};
}

/// A gap limits the recovery. That is an error only if a damaged checkpoint could have continued after it,
/// since without that checkpoint no later version was ever durable.
std::optional<Error> refused_gap(const RecoveryReport& report, const RecoveryOptions& options) {
  if (report.gap_from == 0 || report.damaged_checkpoints.empty() || options.salvage) return std::nullopt;
  return Error{ErrorCode::file, report.damaged_checkpoints.front() +
                                    "; only this checkpoint continues after versions " +
                                    std::to_string(report.gap_from) + " to " + std::to_string(report.gap_to) +
                                    ", which are not in the log"};
}

}  // namespace

Result<Recovered> recover(Disk& disk, const RecoveryOptions& options) {
  const ClockTime begun = options.clock != nullptr ? options.clock->now() : ClockTime{};
  Recovered recovered;
  auto listing = list_log(disk);
  if (!listing) return Error{ErrorCode::file, listing.error().describe()};
  recovered.listing = std::move(listing.value());
  auto database_id = database_id_of(disk, recovered.listing.segments);
  if (!database_id) return database_id.error();
  RecoveryReport& report = recovered.report;
  report.database_id = database_id.value();

  auto from = begin_from_checkpoint(disk, options, recovered);
  if (!from) return from.error();
  report.read_from = from.value();
  if (recovered.listing.segments.empty() && from.value().segment == 0 &&
      !recovered.listing.geometries.empty())
    return Error{ErrorCode::file, geometry_name(recovered.listing.geometries.front()) +
                                      " exists, and there is no segment and no undamaged checkpoint"};
  Replay replay(disk, options, recovered);
  auto log = read_log(disk, recovered.listing.segments,
                      {.database_id = report.database_id,
                       .from = from.value(),
                       .previous_time = recovered.world.time(),
                       .salvage = options.salvage},
                      replay);
  if (!log) return log.error();
  if (replay.unreadable()) return *replay.unreadable();
  report.log = std::move(log).value();
  const Position& next = report.log.next;
  const Position& place = report.read_from;
  if (next.group < place.group || (next.group == place.group && next.link != place.link)) {
    // The groups before the checkpoint are missing or different. The log continues at the checkpoint's
    // position.
    report.log.next = place;
    report.log.last.reset();
  }
  report.version_of_groups = replay.version_of_groups();
  if (auto refused = refused_gap(report, options)) return *refused;
  if (options.clock != nullptr) report.duration = options.clock->now() - begun;
  return recovered;
}

std::string RecoveryReport::describe() const {
  if (database_id == 0) return "there is no log yet";
  std::string text;
  for (const std::string& damaged : damaged_checkpoints)
    text += damaged + "; ";
  text += checkpoint == 0
              ? "from the empty world"
              : "from " + checkpoint_name(checkpoint) + " at version " + std::to_string(checkpoint_version);
  text += ", " + counted(versions, "version") + " in " + counted(log.groups, "group") + " of " +
          counted(log.segments, "segment") + "; " + to_string(log.end);
  if (log.end == LogEnd::torn)
    text += ": " + counted(log.cut_bytes, "byte") + " cut from " + log.cut_file + " at offset " +
            std::to_string(log.cut_offset) + ", " + log.cut_why;
  if (!log.damage.empty()) text += ": " + log.damage;
  if (gap_from != 0)
    text +=
        "; versions " + std::to_string(gap_from) + " to " + std::to_string(gap_to) + " are not in the log";
  return text;
}

}  // namespace rtstdb::log
