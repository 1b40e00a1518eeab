#include "runtime/history/run_log.hpp"

#include <utility>

#include "runtime/report/quantities.hpp"
#include "runtime/report/report_files.hpp"

namespace hil::history {
namespace {

namespace fs = std::filesystem;
using Kind = HistoryError::Kind;

constexpr const char* log_folder = "database";

bool is_log(const fs::path& directory) {
  std::error_code error;
  if (!fs::is_directory(directory, error)) return false;
  for (const fs::directory_entry& entry : fs::directory_iterator(directory, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with("segment.") || name.starts_with("checkpoint.")) return true;
  }
  if (error) throw HistoryError(Kind::file, directory.string() + " can not be read: " + error.message());
  return false;
}

/// The directory of the log. Throws HistoryError if there is none.
fs::path find_log(const fs::path& directory) {
  std::error_code error;
  if (!fs::is_directory(directory, error))
    throw HistoryError(Kind::file, "'" + directory.string() + "' is not a directory");
  if (is_log(directory)) return directory;
  if (is_log(directory / log_folder)) return directory / log_folder;
  const auto why = [&] {
    if (fs::exists(directory / log_folder, error)) return ": its folder 'database' holds no log segment";
    if (fs::exists(directory / "world.json", error))
      return ": the run wrote none (world.durability: volatile)";
    if (fs::exists(directory / "report.json", error)) return ": the run opened no database";
    return " and no folder 'database' of a run";
  };
  throw HistoryError(Kind::file, directory.string() + " holds no log of a database" + why());
}

/// The folder of the run that the log belongs to; empty: none.
fs::path run_folder_of(const fs::path& log) {
  const fs::path whole =
      (fs::absolute(log) / "").lexically_normal().parent_path();  // without a trailing slash
  return whole.filename() == log_folder ? whole.parent_path() : fs::path();
}

void load(RunLog& run, const fs::path& folder) {
  std::error_code error;
  if (fs::exists(folder / "world.json", error)) run.database_id = report::load_world(folder).database_id;
  if (fs::exists(folder / "report.json", error)) run.report = report::load_report(folder);
}

}  // namespace

RunLog find_run_log(const fs::path& directory) {
  RunLog run;
  run.log = find_log(directory);
  if (run.log != directory) {
    try {
      std::error_code error;
      if (fs::exists(directory / "report.json", error)) run.report = report::load_report(directory);
    } catch (const report::ReportError& fault) {
      run.report_fault = fault.what();
    }
    return run;
  }
  const fs::path folder = run_folder_of(run.log);
  if (folder.empty()) return run;
  try {
    load(run, folder);
  } catch (const report::ReportError&) {
    // The query concerns the log alone, which these files are not part of.
    run.report.reset();
  }
  if (run.database_id.empty()) run.report.reset();
  return run;
}

bool belongs_to(const RunLog& run, std::uint64_t database_id) {
  return run.database_id.empty() || run.database_id == report::id_text(database_id);
}

std::string missing_versions(const RunLog& run, const rtstdb::HistoryExtent& extent) {
  if (!run.report_fault.empty())
    return run.report_fault + "; without the report it is unknown how many versions the log must have";
  if (!run.report || !belongs_to(run, extent.database_id)) return {};
  const rtstdb::Version durable = run.report->database_log.durable_version;
  if (durable <= extent.last.version) return {};
  const rtstdb::Version first = extent.last.version + 1;
  const std::string missing = first == durable ? "version " + std::to_string(first) + " is missing"
                                               : "versions " + std::to_string(first) + " to " +
                                                     std::to_string(durable) + " are missing";
  return "it ends with " + describe(extent.last) + ", but according to the run's report version " +
         std::to_string(durable) + " was on disk: " + missing;
}

std::string missing_of(const RunLog& run, const rtstdb::HistoryExtent& extent, bool salvage) {
  const std::string missing = missing_versions(run, extent);
  if (missing.empty()) return {};
  std::string sentence = run.log.string() + ": " + missing;
  if (salvage) return sentence;
  throw HistoryError(Kind::file, sentence + "; take an undamaged copy, or read up to " +
                                     describe(extent.last) + " with --salvage");
}

rtstdb::HistoryExtent read_extent(const RunLog& run, bool salvage) {
  auto extent = rtstdb::history_extent(run.log, salvage);
  if (extent) return std::move(extent).value();
  std::string sentence = extent.error().message;
  if (!salvage) {
    const auto salvaged = rtstdb::history_extent(run.log, true);
    if (salvaged && !salvaged.value().damage.empty())
      sentence +=
          "; take an undamaged copy, or read up to " + describe(salvaged.value().last) + " with --salvage";
  }
  throw HistoryError(Kind::file, sentence);
}

std::string not_closed(const rtstdb::HistoryExtent& extent) {
  if (extent.closed || !extent.damage.empty()) return {};
  return "the log was not closed (the run was killed, is still running, or its disk refused writes): it "
         "ends with " +
         describe(extent.last);
}

std::string describe(const rtstdb::VersionInfo& version) {
  if (version.version == 0) return "version 0, the empty world";
  return "version " + std::to_string(version.version) + " of " +
         report::to_ascii(
             report::shortest(static_cast<double>(version.time.time_since_epoch().count()) / 1e9)) +
         " s";
}

}  // namespace hil::history
