#pragma once
// What a run left of its world: the database's log, the names that the scenario gave, and how long the run was. Also of one that was
// killed, or is still running. Nothing in the folder is changed.
//
// Threads: one; reads files and allocates.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <rtstdb/history.hpp>

#include "runtime/contribution/world_record.hpp"
#include "runtime/history/history_error.hpp"
#include "runtime/history/run_log.hpp"
#include "runtime/modules/laser_scanner/scanner_record.hpp"

namespace hil::history {

class RunHistory {
 public:
  /// Reads a run's folder, or a database's directory, in which nothing has a name. Throws HistoryError (file)
  /// with the place for a damaged log, for a log that lacks versions which were on disk by the run's report,
  /// and for a damaged world.json or report.json. With `salvage` it leaves out what is damaged, and damage()
  /// says what is missing. Throws, too, for a world.json of another database, or with names that no run
  /// writes.
  RunHistory(const std::filesystem::path& directory, bool salvage);

  const std::filesystem::path& log() const noexcept { return log_; }
  bool salvage() const noexcept { return salvage_; }
  const contribution::WorldRecord& world() const noexcept { return world_; }
  const std::vector<modules::ScannerRecord>& scanners() const noexcept { return scanners_; }
  const rtstdb::HistoryExtent& extent() const noexcept { return extent_; }
  /// Run time at which the run was over; empty: it left no report, or is still running.
  const std::optional<std::int64_t>& end_ns() const noexcept { return end_ns_; }
  /// What salvage left out, in sentences; empty: nothing.
  std::string damage() const;
  /// A sentence that says where the log ends, for a log that was not closed; else empty.
  const std::string& not_closed() const noexcept { return not_closed_; }
  /// Empty, or a sentence: the run went on to versions that the log has not.
  std::string shortfall() const;

  /// Refuses what is before run time 0, behind the run's end, before what the log can tell of, or behind it where the run went on:
  /// HistoryError (question).
  void check_time(std::int64_t time_ns) const;
  /// Empty, or a sentence: at that time nothing tells whether the run was still going on.
  std::string doubt_about(std::int64_t time_ns) const;

  /// By its name, or "12.3" for index and generation. Throws HistoryError (question) with the nearest name. Whether it lives at the time
  /// that is asked about is another matter.
  rtstdb::EntityId find(const std::string& name) const;
  /// Its name; one without is called by index and generation.
  std::string name_of(rtstdb::EntityId entity) const;
  /// All bits for an empty list. Throws HistoryError (question) with the nearest layer.
  std::uint32_t mask_of(const std::vector<std::string>& layers) const;
  /// "static, vehicle"; a bit without a name by its number.
  std::string layers_of(std::uint32_t mask) const;
  /// Throws HistoryError (question).
  const modules::ScannerRecord& scanner(const std::string& name) const;

 private:
  void load_world(const std::filesystem::path& directory);

  std::filesystem::path log_;
  bool salvage_;
  contribution::WorldRecord world_;
  std::vector<modules::ScannerRecord> scanners_;
  rtstdb::HistoryExtent extent_;
  std::optional<std::int64_t> end_ns_;
  rtstdb::Version latest_of_run_ = 0;  // by its report; 0: it left none
  std::vector<std::string> damage_;
  std::string not_closed_;
};

}  // namespace hil::history
