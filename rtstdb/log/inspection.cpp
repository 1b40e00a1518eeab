#include "rtstdb/log/inspection.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "rtstdb/geometry/counted.hpp"
#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/log_replay.hpp"
#include "rtstdb/log/recovery.hpp"
#include "rtstdb/log/segment_chain.hpp"
#include "rtstdb/log/stored_row.hpp"

namespace rtstdb::log {
namespace {

std::array<std::byte, row_bytes> bytes_of(const EntityRow& row) {
  std::array<std::byte, row_bytes> bytes{};
  ByteWriter writer(bytes);
  put_row(writer, row);
  return bytes;
}

bool same_state(const EntityState& a, const EntityState& b) {
  if (a.id != b.id) return false;
  return !a.id.valid() || (a.written_by == b.written_by && a.row.geometry == b.row.geometry &&
                           bytes_of(a.row) == bytes_of(b.row));
}

/// A sentence on how the materials or the lights of two worlds differ; empty: they do not.
template <class Value>
std::string difference(const char* noun, const std::vector<LoggedDefinition<Value>>& commits,
                       const std::vector<LoggedDefinition<Value>>& checkpoint) {
  const std::size_t both = std::min(commits.size(), checkpoint.size());
  for (std::size_t k = 0; k < both; ++k) {
    if (commits[k].name != checkpoint[k].name || commits[k].value != checkpoint[k].value)
      return noun + (" " + std::to_string(commits[k].id.index)) + " differs from the result of the commits";
  }
  return {};
}

/// A sentence on how two worlds of one version differ; empty: they do not. An index that was never used
/// equals a missing one. Geometries, materials and lights of the checkpoint alone are ignored, since they may
/// have been added after the commit.
std::string difference(const World& commits, const World& checkpoint) {
  const std::size_t indices = std::max(commits.rows.size(), checkpoint.rows.size());
  const auto generation = [](const World& world, std::size_t index) {
    return index < world.generations.size() ? world.generations[index] : 0;
  };
  const auto row = [](const World& world, std::size_t index) {
    return index < world.rows.size() ? world.rows[index] : EntityState{};
  };
  for (std::size_t index = 0; index < indices; ++index) {
    if (generation(commits, index) != generation(checkpoint, index) ||
        !same_state(row(commits, index), row(checkpoint, index)))
      return "entity " + std::to_string(index) + " differs from the result of the commits";
  }
  const std::size_t geometries = std::min(commits.geometries.size(), checkpoint.geometries.size());
  for (std::size_t index = 0; index < geometries; ++index) {
    const WorldGeometry& a = commits.geometries[index];
    const WorldGeometry& b = checkpoint.geometries[index];
    if (a.logged.name != b.logged.name || a.logged.file != b.logged.file ||
        a.shape_version != b.shape_version || a.positions_m != b.positions_m)
      return "geometry " + std::to_string(index) + " differs from the result of the commits";
  }
  if (std::string different = difference("material", commits.materials, checkpoint.materials);
      !different.empty())
    return different;
  return difference("light", commits.lights, checkpoint.lights);
}

class ReplayInspector final : public ReplayListener {
 public:
  ReplayInspector(Disk& disk, LogContents& contents) : disk_(disk), contents_(contents) {}

  void add_checkpoint(Version version, std::uint64_t number, std::size_t place) {
    checkpoints_of_[version].push_back({number, place});
  }

  void world(const World& world) override {
    if (!begun_) contents_.extent.first = world.latest;
    begun_ = true;
    contents_.extent.last = world.latest;
    contents_.entities = static_cast<std::uint64_t>(
        std::ranges::count_if(world.rows, [](const EntityState& state) { return state.id.valid(); }));
    for (const WorldGeometry& geometry : world.geometries)
      this->geometry(geometry);
  }
  void geometry(const WorldGeometry& geometry) override {
    names_[geometry.logged.file] = geometry.logged.name;
  }
  void material(const LoggedMaterial& /*material*/) override {}
  void light(const LoggedLight& /*light*/) override {}
  void commit(const store::WriteSet& set, const World& now, std::uint64_t segment) override {
    ++contents_.extent.commits;
    contents_.row_writes += set.writes.size();
    contents_.shape_writes += set.shapes.size();
    auto& versions = versions_of_[segment];
    if (versions.first == 0) versions.first = set.version;
    versions.second = set.version;
    contents_.extent.last = now.latest;
    for (const store::Write& write : set.writes) {
      if (write.kind == store::WriteKind::create) ++contents_.entities;
      if (write.kind == store::WriteKind::remove) --contents_.entities;
    }
    compare_checkpoints(now);
  }
  void gap(const Gap& gap) override { contents_.extent.gaps.push_back({gap.first, gap.last}); }
  void unresolved(const Gap& /*between*/, std::uint64_t commits) override {
    contents_.unresolved_commits += commits;
  }

  /// End of the history.
  void end() {
    for (const auto& [place, geometry] : added_later_)
      if (name_of(geometry.file) != geometry.name)
        contents_.files[place].damage =
            "it has geometry " + std::to_string(geometry.id.index) + ", which no record adds";
  }

  /// None: no readable record refers to that file.
  std::optional<std::string> name_of(std::uint64_t geometry_file) const {
    const auto found = names_.find(geometry_file);
    return found == names_.end() ? std::nullopt : std::optional(found->second);
  }
  std::pair<Version, Version> versions_in(std::uint64_t segment) const {
    const auto found = versions_of_.find(segment);
    return found == versions_of_.end() ? std::pair<Version, Version>{} : found->second;
  }

 private:
  void compare_checkpoints(const World& now) {
    const auto found = checkpoints_of_.find(now.latest.version);
    if (found == checkpoints_of_.end()) return;
    for (const auto& [number, place] : found->second) {
      auto checkpoint = read_checkpoint(disk_, number, contents_.database_id);
      if (!checkpoint) continue;  // removed since the folder was listed
      ++contents_.compared_checkpoints;
      const World& world = checkpoint.value().world;
      contents_.files[place].damage = difference(now, world);
      for (std::size_t k = now.geometries.size(); k < world.geometries.size(); ++k)
        added_later_.emplace_back(place, world.geometries[k].logged);
    }
  }

  Disk& disk_;
  LogContents& contents_;
  bool begun_ = false;
  std::map<Version, std::vector<std::pair<std::uint64_t, std::size_t>>>
      checkpoints_of_;                          // number, index in LogContents::files
  std::map<std::uint64_t, std::string> names_;  // by geometry file
  std::map<std::uint64_t, std::pair<Version, Version>> versions_of_;
  std::vector<std::pair<std::size_t, LoggedGeometry>>
      added_later_;  // index of the checkpoint in LogContents::files, geometry
};

/// Removes the name of the file at the beginning of the message.
std::string without_prefix(const std::string& message, const std::string& name) {
  return message.starts_with(name) ? message.substr(std::min(message.size(), name.size() + 2)) : message;
}

class Inspection {
 public:
  Inspection(Disk& disk, Listing listing) : disk_(disk), listing_(std::move(listing)) {}

  Result<LogContents> all() {
    list(LogFileKind::segment, listing_.segments, segment_name);
    list(LogFileKind::checkpoint, listing_.checkpoints, checkpoint_name);
    list(LogFileKind::geometry, listing_.geometries, geometry_name);
    list(LogFileKind::unfinished, listing_.unfinished_segments, unfinished_segment_name);
    list(LogFileKind::unfinished, listing_.unfinished_checkpoints, unfinished_checkpoint_name);
    list(LogFileKind::abandoned, listing_.abandoned_checkpoints, abandoned_checkpoint_name);
    ReplayInspector inspector(disk_, contents_);
    inspect_checkpoints(inspector);
    auto report = replay_log(disk_, true, inspector);
    inspector.end();
    if (report) {
      contents_.extent.database_id = report.value().database_id;
      take(report.value());
    } else if (contents_.database_id == 0 && listing_.segments.empty()) {
      return report.error();
    } else {
      contents_.damage.push_back(report.error().message);
    }
    inspect_segments(inspector);
    inspect_geometries(inspector);
    for (LogFile& file : contents_.files) {
      if (file.kind == LogFileKind::unfinished) file.note = "it is unfinished and is ignored";
      if (file.kind == LogFileKind::abandoned) file.note = "a salvage set it aside; it is ignored";
      if (!file.damage.empty()) contents_.damage.push_back(file.name + ": " + file.damage);
    }
    check_opening();
    return std::move(contents_);
  }

 private:
  void list(LogFileKind kind, const std::vector<std::uint64_t>& numbers, std::string (*name)(std::uint64_t)) {
    for (const std::uint64_t number : numbers) {
      LogFile file{.name = name(number), .kind = kind, .note = {}, .damage = {}};
      auto opened = disk_.open(file.name);
      if (opened) {
        auto size = opened.value()->size();
        if (size) file.bytes = size.value();
        if (!size) file.damage = size.error().describe();
      } else if (kind == LogFileKind::unfinished) {
        continue;  // renamed to its final name since
      } else {
        file.damage = opened.error().describe();
      }
      contents_.files.push_back(std::move(file));
    }
  }

  template <class Visit>
  void for_each(LogFileKind kind, const std::vector<std::uint64_t>& numbers, const Visit& visit) {
    std::size_t k = 0;
    for (std::size_t place = 0; place < contents_.files.size(); ++place)
      if (contents_.files[place].kind == kind) visit(place, numbers[k++]);
  }

  void inspect_checkpoints(ReplayInspector& inspector) {
    auto database_id = database_id_of_all();
    contents_.database_id = database_id;
    if (database_id != 0) contents_.format = format_version;
    for_each(LogFileKind::checkpoint, listing_.checkpoints, [&](std::size_t place, std::uint64_t number) {
      LogFile& file = contents_.files[place];
      if (!file.damage.empty()) return;
      auto checkpoint = read_checkpoint(disk_, number, database_id);
      if (!checkpoint) {
        file.damage = without_prefix(checkpoint.error().message, file.name);
        return;
      }
      file.first = file.last = checkpoint.value().header.version;
      inspector.add_checkpoint(file.last, number, place);
    });
  }

  std::uint64_t database_id_of_all() {
    if (auto id = database_id_of(disk_, listing_.segments); id && id.value() != 0) return id.value();
    for (const std::uint64_t number : listing_.checkpoints)
      if (auto header = read_checkpoint_header(disk_, number)) return header.value().database_id;
    return 0;
  }

  void take(const ReadReport& report) {
    contents_.groups = report.groups;
    contents_.bytes = report.bytes;
    contents_.extent.closed = report.end == LogEnd::closed;
    contents_.extent.damage = report.damage;
    if (!report.damage.empty()) contents_.damage.push_back(report.damage);
    if (report.end == LogEnd::torn)
      contents_.torn = report.cut_file + ", offset " + std::to_string(report.cut_offset) + ", " +
                       counted(report.cut_bytes, "byte") + ": " + report.cut_why;
  }

  void inspect_segments(const ReplayInspector& inspector) {
    for_each(LogFileKind::segment, listing_.segments, [&](std::size_t place, std::uint64_t number) {
      LogFile& file = contents_.files[place];
      std::tie(file.first, file.last) = inspector.versions_in(number);
      if (file.first == 0) file.note = "it has no readable commit";
    });
  }

  void inspect_geometries(const ReplayInspector& inspector) {
    for_each(LogFileKind::geometry, listing_.geometries, [&](std::size_t place, std::uint64_t number) {
      LogFile& file = contents_.files[place];
      const auto name = inspector.name_of(number);
      file.note = name ? *name
                  : contents_.extent.damage.empty()
                      ? "no record refers to it: its geometry was not added completely"
                      : "no readable record refers to it";
    });
  }

  void check_opening() {
    auto recovered = recover(disk_);
    contents_.opens = recovered.ok();
    if (recovered) {
      contents_.opens_at = recovered.value().world.latest.version;
      return;
    }
    contents_.refusal = recovered.error().message;
    contents_.opens_by_salvage = recover(disk_, {.salvage = true}).ok();
  }

  Disk& disk_;
  Listing listing_;
  LogContents contents_;
};

}  // namespace

Result<LogContents> inspect(Disk& disk) {
  auto listing = list_log(disk);
  if (!listing) return Error{ErrorCode::file, listing.error().describe()};
  return Inspection(disk, std::move(listing.value())).all();
}

}  // namespace rtstdb::log
