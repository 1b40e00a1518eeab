#include "runtime/cli/db_export.hpp"

#include <nlohmann/json.hpp>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>

#include <rtstdb/log.hpp>

#include "runtime/cli/flush_output.hpp"
#include "runtime/history/run_log.hpp"
#include "runtime/report/text_safety.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

using Json = nlohmann::ordered_json;

Json vector(const glm::dvec3& v) {
  return {v.x, v.y, v.z};
}

Json id(rtstdb::EntityId entity) {
  return {entity.index, entity.generation};
}

Json motion(const rtstdb::Motion& motion) {
  const glm::dquat& q = motion.q_world;
  return {{"p_world_m", vector(motion.p_world_m)},
          {"q_world_wxyz", {q.w, q.x, q.y, q.z}},
          {"v_world_mps", vector(motion.v_world_mps)},
          {"w_world_radps", vector(motion.w_world_radps)},
          {"valid_from_ns", motion.valid_from.time_since_epoch().count()}};
}

Json row(const rtstdb::EntityRow& row) {
  Json json;
  json["geometry"] = row.geometry.valid() ? Json(row.geometry.index) : Json(nullptr);
  json["scale"] = vector(row.scale);
  json["mask"] = row.mask;
  json["material"] = row.material.index;
  json["light"] = row.light.valid() ? Json(row.light.index) : Json(nullptr);
  json["motion"] = motion(row.motion);
  return json;
}

/// What the write held: a whole row, a motion, or only the entity.
Json write_json(const rtstdb::LogWrite& write) {
  Json json{{"write", rtstdb::to_string(write.kind)}, {"entity", id(write.state.id)}};
  if (write.kind == rtstdb::LogWrite::Kind::update_motion) json["motion"] = motion(write.state.row.motion);
  if (write.kind == rtstdb::LogWrite::Kind::create || write.kind == rtstdb::LogWrite::Kind::update)
    json["row"] = row(write.state.row);
  return json;
}

Json vectors(std::span<const glm::vec3> vectors) {
  Json list = Json::array();
  for (const glm::vec3& v : vectors)
    list.push_back({v.x, v.y, v.z});
  return list;
}

Json corner_values(std::span<const rtstdb::CornerValues> values) {
  Json list = Json::array();
  for (const rtstdb::CornerValues& corners : values)
    list.push_back(vectors(corners));
  return list;
}

class Lines final : public rtstdb::LogListener {
 public:
  Lines(std::FILE* file, bool without_meshes) : file_(file), without_meshes_(without_meshes) {}

  void world(const rtstdb::VersionInfo& at, std::span<const rtstdb::EntityState> entities) override {
    Json list = Json::array();
    for (const rtstdb::EntityState& state : entities)
      list.push_back({{"entity", id(state.id)}, {"written_by", state.written_by}, {"row", row(state.row)}});
    Json json{{"line", "world"}, {"version", at.version}, {"time_ns", nullptr}};
    if (at.version > 0) json["time_ns"] = at.time.time_since_epoch().count();
    json["entities"] = std::move(list);
    put(json);
  }
  void geometry(rtstdb::GeometryId geometry, std::string_view name, const rtstdb::GeometryOptions& options,
                const rtstdb::TriangleMesh& mesh) override {
    Json json{{"line", "geometry"},
              {"geometry", geometry.index},
              {"name", report::valid_utf8(std::string(name))},
              {"deforms", options.deforms}};
    if (!without_meshes_) {
      json["positions_m"] = vectors(mesh.positions_m);
      json["triangles"] = Json::array();
      for (const glm::uvec3& corners : mesh.triangles)
        json["triangles"].push_back({corners.x, corners.y, corners.z});
      if (!mesh.corner_normals.empty()) json["corner_normals"] = corner_values(mesh.corner_normals);
      if (!mesh.corner_colors.empty()) json["corner_colors"] = corner_values(mesh.corner_colors);
    }
    put(json);
  }
  void material(rtstdb::MaterialId material, std::string_view name,
                const rtstdb::Material& properties) override {
    put({{"line", "material"},
         {"material", material.index},
         {"name", report::valid_utf8(std::string(name))},
         {"reflectance", properties.reflectance},
         {"retro_gain", properties.retro_gain},
         {"base_color", vector(properties.base_color)},
         {"metallic", properties.metallic},
         {"roughness", properties.roughness},
         {"emission_cdpm2", vector(properties.emission_cdpm2)},
         {"transmission", properties.transmission},
         {"refractive_index", properties.refractive_index}});
  }
  void light(rtstdb::LightId light, std::string_view name, const rtstdb::Light& properties) override {
    put({{"line", "light"},
         {"light", light.index},
         {"name", report::valid_utf8(std::string(name))},
         {"kind", rtstdb::to_string(properties.kind)},
         {"color", vector(properties.color)},
         {"p_m", vector(properties.p_m)},
         {"illuminance_lx", properties.illuminance_lx},
         {"intensity_cd", properties.intensity_cd},
         {"inner_angle_rad", properties.inner_angle_rad},
         {"outer_angle_rad", properties.outer_angle_rad},
         {"angular_diameter_rad", properties.angular_diameter_rad},
         {"zenith_cdpm2", vector(properties.zenith_cdpm2)},
         {"horizon_cdpm2", vector(properties.horizon_cdpm2)},
         {"ground_cdpm2", vector(properties.ground_cdpm2)}});
  }
  void commit(const rtstdb::VersionInfo& version, std::span<const rtstdb::LogWrite> writes,
              std::span<const rtstdb::LogShape> shapes) override {
    Json json{{"line", "commit"},
              {"version", version.version},
              {"time_ns", version.time.time_since_epoch().count()},
              {"writes", Json::array()}};
    for (const rtstdb::LogWrite& write : writes)
      json["writes"].push_back(write_json(write));
    for (const rtstdb::LogShape& shape : shapes) {
      Json one{{"geometry", shape.geometry.index}};
      if (!without_meshes_) one["positions_m"] = vectors(shape.positions_m);
      json["shapes"].push_back(std::move(one));
    }
    put(json);
  }
  void gap(rtstdb::Version first, rtstdb::Version last) override {
    put({{"line", "gap"}, {"first_version", first}, {"last_version", last}});
  }
  void unresolved(rtstdb::Version first, rtstdb::Version last, std::uint64_t commits) override {
    put({{"line", "unresolved"}, {"first_version", first}, {"last_version", last}, {"commits", commits}});
  }

  /// errno of the first line that could not be written; 0: none.
  int failure() const noexcept { return failure_; }

 private:
  void put(const Json& json) {
    const std::string text = json.dump() + '\n';
    const bool whole = std::fwrite(text.data(), 1, text.size(), file_) == text.size();
    if (!whole && failure_ == 0) failure_ = errno;
  }

  std::FILE* file_;
  bool without_meshes_;
  int failure_ = 0;
};

struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};

/// Prints a note for the reader of the export to stderr, unless it is empty.
void note(const std::string& sentence) {
  if (!sentence.empty()) std::fprintf(stderr, "hil db export: %s\n", sentence.c_str());
}

}  // namespace

int export_log(const std::string& directory, const ExportOptions& options) {
  const history::RunLog run = history::find_run_log(directory);
  // Read before anything is written, so that a damaged log leaves no partial export.
  const rtstdb::HistoryExtent extent = history::read_extent(run, options.salvage);
  const std::string missing = history::missing_of(run, extent, options.salvage);
  std::unique_ptr<std::FILE, Close> own;
  if (!options.file.empty()) {
    own.reset(std::fopen(options.file.c_str(), "wb"));
    if (!own) {
      std::fprintf(stderr, "hil db export: %s can not be written: %s\n", options.file.c_str(),
                   std::strerror(errno));
      return run::exit_io_failed;
    }
  }
  Lines lines(own ? own.get() : stdout, options.without_meshes);
  const auto read = rtstdb::read_log(run.log, lines, options.salvage);
  int exit_code = run::exit_passed;
  if (!read) {
    note(read.error().message);
    exit_code = run::exit_io_failed;
  } else if (!read.value().empty()) {
    note("damaged, and exported up to " + history::describe(extent.last) + ": " + read.value());
  }
  note(missing);
  note(history::not_closed(extent));
  if (!own) return flush_output("db export", exit_code);
  const bool ended = std::fclose(own.release()) == 0;
  const int failure = lines.failure() != 0 || ended ? lines.failure() : errno;
  if (failure == 0) return exit_code;
  std::fprintf(stderr, "hil db export: %s can not be written: %s\n", options.file.c_str(),
               std::strerror(failure));
  return run::exit_io_failed;
}

}  // namespace hil::cli
