#include "runtime/history/run_history.hpp"

#include <algorithm>
#include <charconv>
#include <utility>

#include <hil/diagnostics.hpp>
#include <hil/module.hpp>
#include <hil/record.hpp>
#include <rtstdb/limits.hpp>

#include "runtime/modules/registry.hpp"
#include "runtime/plugins/plugins.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/report_files.hpp"

namespace hil::history {
namespace {

namespace fs = std::filesystem;
using Kind = HistoryError::Kind;

std::string seconds(std::int64_t ns) {
  return report::to_ascii(report::shortest(static_cast<double>(ns) / 1e9)) + " s";
}

std::string number_of(rtstdb::EntityId entity) {
  return std::to_string(entity.index) + "." + std::to_string(entity.generation);
}

/// "12.3"
std::optional<rtstdb::EntityId> parse_number(const std::string& text) {
  rtstdb::EntityId entity;
  const char* const end = text.data() + text.size();
  const auto index = std::from_chars(text.data(), end, entity.index);
  if (index.ec != std::errc() || index.ptr == end || *index.ptr != '.') return std::nullopt;
  const auto generation = std::from_chars(index.ptr + 1, end, entity.generation);
  if (generation.ec != std::errc() || generation.ptr != end) return std::nullopt;
  return entity;
}

/// The end of the run according to its report.
std::int64_t end_of(const report::RunRecord& record) {
  constexpr std::int64_t longest_ns = rtstdb::max_world_time_ns / 2;
  if (record.period_ns <= 0 || record.ticks > static_cast<std::uint64_t>(longest_ns / record.period_ns))
    throw HistoryError(Kind::file, "report.json: " + std::to_string(record.ticks) + " ticks of " +
                                       std::to_string(record.period_ns) + " ns do not make a run");
  const std::int64_t ticks_ns = static_cast<std::int64_t>(record.ticks) * record.period_ns;
  // Skipped ticks took time as well.
  return record.top_view ? std::clamp(record.top_view->time_ns, ticks_ns, longest_ns) : ticks_ns;
}

contribution::WorldRecord load_names(const fs::path& directory) {
  std::error_code error;
  if (!fs::exists(directory / "world.json", error))
    throw HistoryError(
        Kind::file, directory.string() +
                        " holds no world.json: the run ended before its first tick, or the file was removed");
  try {
    contribution::WorldRecord world = report::load_world(directory);
    if (world.layers.size() > 32)
      throw HistoryError(Kind::file, "world.json: " + std::to_string(world.layers.size()) +
                                         " layers; at most 32 are allowed");
    return world;
  } catch (const report::ReportError& fault) {
    throw HistoryError(Kind::file, fault.what());
  }
}

/// The sentences why plug-ins of the run can not be used again; empty: all are loaded.
std::string load_plugins(const contribution::WorldRecord& world) {
  std::string faults;
  for (const plugins::PluginIdentity& plugin : world.plugins) {
    std::string fault;
    const auto loaded = plugins::load_plugin(plugin.path, fault);
    if (loaded && loaded->identity.hash != plugin.hash)
      fault = "plug-in " + plugin.name + " (" + plugin.path + ") is not the file of the run";
    if (!fault.empty()) faults += (faults.empty() ? "" : "; ") + fault;
  }
  return faults;
}

std::vector<std::unique_ptr<modules::RecordedScanner>> scanners_of(const contribution::WorldRecord& world) {
  std::vector<std::unique_ptr<modules::RecordedScanner>> scanners;
  for (const contribution::ModuleRecord& record : world.modules) {
    for (const modules::ModuleType& type : modules::module_types()) {
      if (type.make_recorded_scanner != nullptr && type.recorded_list == record.list)
        scanners.push_back(type.make_recorded_scanner(record));
    }
  }
  return scanners;
}

std::vector<modules::RecordedCamera> cameras_of(const contribution::WorldRecord& world) {
  std::vector<modules::RecordedCamera> cameras;
  for (const contribution::ModuleRecord& record : world.modules)
    if (record.list == modules::camera_list) cameras.push_back(modules::to_recorded_camera(record));
  return cameras;
}

template <class Items, class NameOf>
std::vector<std::string> names_in(const Items& items, const NameOf& name_of) {
  std::vector<std::string> names;
  names.reserve(std::size(items));
  for (const auto& item : items)
    names.push_back(name_of(item));
  return names;
}

}  // namespace

RunHistory::RunHistory(const fs::path& directory, bool salvage) : salvage_(salvage) {
  const RunLog run = find_run_log(directory);
  log_ = run.log;
  const bool is_run = log_ != directory;
  if (is_run) load_world(directory);
  extent_ = read_extent(run, salvage);
  if (is_run && !world_.database_id.empty() && world_.database_id != report::id_text(extent_.database_id))
    throw HistoryError(Kind::file, directory.string() + ": world.json has the names of database " +
                                       world_.database_id + ", and the log is of " +
                                       report::id_text(extent_.database_id));
  if (const std::string missing = missing_of(run, extent_, salvage); !missing.empty())
    damage_.push_back(missing);
  if (!extent_.damage.empty()) damage_.push_back(extent_.damage);
  not_closed_ = history::not_closed(extent_);
  if (!run.report || !belongs_to(run, extent_.database_id)) return;
  latest_of_run_ = run.report->database_log.latest_version;
  if (is_run) end_ns_ = end_of(*run.report);
}

void RunHistory::load_world(const fs::path& directory) {
  const auto handle = [&](const std::string& fault) {
    if (!salvage_) throw HistoryError(Kind::file, fault + "; --salvage reads the log without it");
    damage_.push_back(fault + "; without it entities, layers, scanners and cameras have no names");
  };
  try {
    contribution::WorldRecord world = load_names(directory);
    if (const std::string fault = load_plugins(world); !fault.empty()) handle(fault);
    auto scanners = scanners_of(world);
    cameras_ = cameras_of(world);
    scanners_ = std::move(scanners);
    world_ = std::move(world);
  } catch (const HistoryError& fault) {
    handle(fault.what());
  } catch (const modules::RecordError& fault) {
    handle(fault.what());
  }
}

std::string RunHistory::damage() const {
  std::string text;
  for (const std::string& sentence : damage_)
    text += (text.empty() ? "" : "; ") + sentence;
  return text;
}

std::string RunHistory::shortfall() const {
  if (latest_of_run_ <= extent_.last.version) return {};
  return "the log ends with " + describe(extent_.last) + ", but the run continued to version " +
         std::to_string(latest_of_run_);
}

void RunHistory::check_time(std::int64_t time_ns) const {
  if (time_ns > rtstdb::max_world_time_ns / 2)
    throw HistoryError(Kind::question, "the time " + seconds(time_ns) + " is longer than any run");
  if (time_ns < 0)
    throw HistoryError(Kind::question,
                       "the time " + seconds(time_ns) + " lies before the beginning of the run at 0 s");
  if (end_ns_ && time_ns > *end_ns_)
    throw HistoryError(Kind::question, "the time " + seconds(time_ns) + " lies after the end of the run at " +
                                           seconds(*end_ns_));
  if (extent_.first.version > 0 && rtstdb::world_time_ns(time_ns) < extent_.first.time)
    throw HistoryError(Kind::question, "the time " + seconds(time_ns) +
                                           " lies before the beginning of the log at " +
                                           seconds(extent_.first.time.time_since_epoch().count()));
  if (const std::string missing = shortfall();
      !missing.empty() && rtstdb::world_time_ns(time_ns) > extent_.last.time)
    throw HistoryError(Kind::question, missing + "; the time " + seconds(time_ns) + " lies after its end");
}

std::string RunHistory::doubt_about(std::int64_t time_ns) const {
  if (end_ns_ || rtstdb::world_time_ns(time_ns) <= extent_.last.time) return {};
  return "the last change in the log was at " + seconds(extent_.last.time.time_since_epoch().count()) +
         "; the run left no report, so it is unknown how long it continued";
}

rtstdb::EntityId RunHistory::find(const std::string& name) const {
  for (const contribution::NamedEntity& entity : world_.entities)
    if (entity.name == name) return {entity.index, entity.generation};
  if (const auto entity = parse_number(name)) return *entity;
  throw HistoryError(Kind::question,
                     "the run has no entity '" + name + "'" +
                         config::suggestion(name, names_in(world_.entities,
                                                           [](const auto& entity) { return entity.name; })));
}

std::string RunHistory::name_of(rtstdb::EntityId entity) const {
  for (const contribution::NamedEntity& named : world_.entities)
    if (named.index == entity.index && named.generation == entity.generation) return named.name;
  return number_of(entity);
}

std::uint32_t RunHistory::mask_of(const std::vector<std::string>& layers) const {
  if (layers.empty()) return rtstdb::mask_all;
  std::uint32_t mask = 0;
  for (const std::string& layer : layers) {
    const auto found = std::ranges::find(world_.layers, layer);
    if (found == world_.layers.end())
      throw HistoryError(Kind::question,
                         "the run has no layer '" + layer + "'" + config::suggestion(layer, world_.layers));
    mask |= std::uint32_t{1} << (found - world_.layers.begin());
  }
  return mask;
}

std::string RunHistory::layers_of(std::uint32_t mask) const {
  std::string text;
  for (std::uint32_t bit = 0; bit < 32; ++bit) {
    if ((mask >> bit & 1u) == 0) continue;
    if (!text.empty()) text += ", ";
    text += bit < world_.layers.size() ? world_.layers[bit] : "bit " + std::to_string(bit);
  }
  return mask == rtstdb::mask_all ? "all" : text;
}

const modules::RecordedScanner& RunHistory::scanner(const std::string& name) const {
  for (const auto& scanner : scanners_)
    if (scanner->description().name == name) return *scanner;
  throw HistoryError(Kind::question,
                     "the run has no scanner '" + name + "'" +
                         config::suggestion(name, names_in(scanners_, [](const auto& scanner) {
                                              return scanner->description().name;
                                            })));
}

const modules::RecordedCamera& RunHistory::camera(const std::string& name) const {
  const auto found = std::ranges::find(cameras_, name, &modules::RecordedCamera::name);
  if (found != cameras_.end()) return *found;
  throw HistoryError(
      Kind::question,
      "the run has no camera '" + name + "'" +
          config::suggestion(name, names_in(cameras_, [](const auto& camera) { return camera.name; })) +
          (damage_.empty() ? std::string() : "; " + damage()));
}

}  // namespace hil::history
