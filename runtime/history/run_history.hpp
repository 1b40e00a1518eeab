#pragma once
// What a run recorded of its world: the database's log, the scenario's names, and the length of the run. Also
// works for a run that was killed or is still running. Does not change the folder.
//
// Threads: one; reads files and allocates.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <hil/world/recorded_scanner.hpp>
#include <rtstdb/history.hpp>

#include "runtime/contribution/world_record.hpp"
#include "runtime/history/history_error.hpp"
#include "runtime/history/run_log.hpp"
#include "runtime/modules/recorded_camera.hpp"

namespace hil::history {

class RunHistory {
 public:
  /// Reads a run's folder, or a database's directory, which has no names. Throws HistoryError (file), with
  /// the place, for a damaged log, for a log without versions that were on disk according to the run's
  /// report, for a damaged world.json or report.json, and for a world.json of another database or with
  /// invalid names. With `salvage` it skips damaged parts, which damage() describes.
  RunHistory(const std::filesystem::path& directory, bool salvage);

  const std::filesystem::path& log() const noexcept { return log_; }
  bool salvage() const noexcept { return salvage_; }
  const contribution::WorldRecord& world() const noexcept { return world_; }
  const std::vector<std::unique_ptr<modules::RecordedScanner>>& scanners() const noexcept {
    return scanners_;
  }
  /// Modules of type camera, and views of the scenario.
  const std::vector<modules::RecordedCamera>& cameras() const noexcept { return cameras_; }
  const rtstdb::HistoryExtent& extent() const noexcept { return extent_; }
  /// Run time of the end of the run; empty: there is no report, or the run is still running.
  const std::optional<std::int64_t>& end_ns() const noexcept { return end_ns_; }
  /// What salvage skipped, in sentences; empty: nothing.
  std::string damage() const;
  /// Where the log ends, as a sentence, if the log was not closed; otherwise empty.
  const std::string& not_closed() const noexcept { return not_closed_; }
  /// Empty, or a sentence: the run had later versions than the log.
  std::string shortfall() const;

  /// Throws HistoryError (question) for a time before run time 0, after the run's end, before the start of
  /// the log, or after the log's end if the run continued.
  void check_time(std::int64_t time_ns) const;
  /// Empty, or a sentence: it is unknown whether the run was still running at that time.
  std::string doubt_about(std::int64_t time_ns) const;

  /// Finds an entity by its name, or by "12.3" for index and generation, whether or not it exists at the time
  /// of a query. Throws HistoryError (question) with the nearest name.
  rtstdb::EntityId find(const std::string& name) const;
  /// The entity's name, or its index and generation if it has none.
  std::string name_of(rtstdb::EntityId entity) const;
  /// All bits for an empty list. Throws HistoryError (question) with the nearest layer.
  std::uint32_t mask_of(const std::vector<std::string>& layers) const;
  /// "static, vehicle"; bits without a name are numbered.
  std::string layers_of(std::uint32_t mask) const;
  /// Throws HistoryError (question).
  const modules::RecordedScanner& scanner(const std::string& name) const;
  /// Throws HistoryError (question).
  const modules::RecordedCamera& camera(const std::string& name) const;

 private:
  void load_world(const std::filesystem::path& directory);

  std::filesystem::path log_;
  bool salvage_;
  contribution::WorldRecord world_;
  std::vector<std::unique_ptr<modules::RecordedScanner>> scanners_;
  std::vector<modules::RecordedCamera> cameras_;
  rtstdb::HistoryExtent extent_;
  std::optional<std::int64_t> end_ns_;
  rtstdb::Version latest_of_run_ = 0;  // according to the report; 0: there is none
  std::vector<std::string> damage_;
  std::string not_closed_;
};

}  // namespace hil::history
