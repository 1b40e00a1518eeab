#include <new>
#include <optional>
#include <vector>

#include <rtstdb/log.hpp>

#include "rtstdb/directory_error.hpp"
#include "rtstdb/log/inspection.hpp"
#include "rtstdb/log/log_replay.hpp"
#include "rtstdb/log/posix_disk.hpp"

namespace rtstdb {
namespace {

Error log_too_large(const std::filesystem::path& directory) {
  return with_directory(directory, {ErrorCode::out_of_memory, "the log does not fit into memory"});
}

LogWrite::Kind kind_of(store::WriteKind kind) {
  switch (kind) {
    case store::WriteKind::create:
      return LogWrite::Kind::create;
    case store::WriteKind::update:
      return LogWrite::Kind::update;
    case store::WriteKind::update_motion:
      return LogWrite::Kind::update_motion;
    case store::WriteKind::remove:
      return LogWrite::Kind::remove;
  }
  return LogWrite::Kind::remove;
}

/// Converts the internal types of the log into the public ones.
class ListenerAdapter final : public log::ReplayListener {
 public:
  explicit ListenerAdapter(LogListener& listener) : listener_(listener) {}

  void world(const log::World& world) override {
    for (const log::WorldGeometry& geometry : world.geometries)
      this->geometry(geometry);
    for (const log::LoggedMaterial& material : world.materials)
      this->material(material);
    for (const log::LoggedLight& light : world.lights)
      this->light(light);
    std::vector<EntityState> entities;
    for (const EntityState& state : world.rows)
      if (state.id.valid()) entities.push_back(state);
    listener_.world(world.latest, entities);
  }
  void geometry(const log::WorldGeometry& geometry) override {
    if (geometry.positions_m.empty()) {
      listener_.geometry(geometry.logged.id, geometry.logged.name, geometry.logged.options, geometry.mesh);
    } else {
      listener_.geometry(geometry.logged.id, geometry.logged.name, geometry.logged.options,
                         {.positions_m = geometry.positions_m,
                          .triangles = geometry.mesh.triangles,
                          .corner_colors = geometry.mesh.corner_colors});
    }
  }
  void material(const log::LoggedMaterial& material) override {
    listener_.material(material.id, material.name, material.value);
  }
  void light(const log::LoggedLight& light) override { listener_.light(light.id, light.name, light.value); }
  void commit(const store::WriteSet& set, const log::World& /*now*/, std::uint64_t /*segment*/) override {
    writes_.clear();
    shapes_.clear();
    for (const store::Write& write : set.writes)
      writes_.push_back({kind_of(write.kind), write.state});
    for (const store::ShapeWrite& shape : set.shapes)
      shapes_.push_back({shape.geometry, shape.positions_m});
    listener_.commit({set.version, set.time}, writes_, shapes_);
  }
  void gap(const log::Gap& gap) override { listener_.gap(gap.first, gap.last); }
  void unresolved(const log::Gap& between, std::uint64_t commits) override {
    listener_.unresolved(between.first, between.last, commits);
  }

 private:
  LogListener& listener_;
  std::vector<LogWrite> writes_;
  std::vector<LogShape> shapes_;
};

}  // namespace

const char* to_string(LogFileKind kind) noexcept {
  switch (kind) {
    case LogFileKind::segment:
      return "segment";
    case LogFileKind::checkpoint:
      return "checkpoint";
    case LogFileKind::geometry:
      return "geometry";
    case LogFileKind::unfinished:
      return "unfinished";
    case LogFileKind::abandoned:
      return "abandoned";
  }
  return "unknown";
}

const char* to_string(LogWrite::Kind kind) noexcept {
  switch (kind) {
    case LogWrite::Kind::create:
      return "create";
    case LogWrite::Kind::update:
      return "update";
    case LogWrite::Kind::update_motion:
      return "update_motion";
    case LogWrite::Kind::remove:
      return "remove";
  }
  return "unknown";
}

Result<LogContents> inspect_log(const std::filesystem::path& directory) {
  auto disk = log::open_existing_directory(directory);
  if (!disk) return with_directory(directory, {ErrorCode::file, disk.error().describe()});
  try {
    auto contents = log::inspect(*disk.value());
    if (!contents) return with_directory(directory, contents.error());
    return contents;
  } catch (const std::bad_alloc&) {
    return log_too_large(directory);
  }
}

Result<std::string> read_log(const std::filesystem::path& directory, LogListener& listener, bool salvage) {
  auto disk = log::open_existing_directory(directory);
  if (!disk) return with_directory(directory, {ErrorCode::file, disk.error().describe()});
  try {
    ListenerAdapter adapter(listener);
    auto report = log::replay_log(*disk.value(), salvage, adapter);
    if (!report) return with_directory(directory, report.error());
    return report.value().damage;
  } catch (const std::bad_alloc&) {
    return log_too_large(directory);
  }
}

}  // namespace rtstdb
