#pragma once
// The distance fields of a run's scenery: their options, the progress of long builds, and what a history
// needs to build them again.
//
// Threads: configuration, one thread.

#include <chrono>
#include <string>
#include <vector>

#include <rtstdb/database.hpp>

#include "runtime/config/scenario.hpp"
#include "runtime/contribution/world_record.hpp"
#include "runtime/run/run_log.hpp"

namespace hil::run {

class WorldFields {
 public:
  /// `log` outlives it. Builds of more than a second have their progress on stderr.
  explicit WorldFields(RunLog& log) : log_(log) {}
  WorldFields(const WorldFields&) = delete;
  WorldFields& operator=(const WorldFields&) = delete;

  /// A field that is built when a query first needs it. This object has to outlive the build.
  rtstdb::FieldOptions options_of(const std::string& name, const config::DistanceField& field);
  void add(rtstdb::GeometryId geometry, const std::string& name, const config::DistanceField& field);

  /// Writes the size and the error of each field that was built to the log.
  void log_built(const rtstdb::Database& database);
  /// Of all fields, built or not.
  std::vector<contribution::FieldRecord> records() const;

 private:
  using SteadyClock = std::chrono::steady_clock;

  struct Entry {
    std::string name;
    contribution::FieldRecord record;
  };

  void show(const std::string& name, const rtstdb::FieldProgress& progress);

  RunLog& log_;
  std::vector<Entry> entries_;
  std::string shown_name_;  ///< of the field that is built
  SteadyClock::time_point next_{};
};

}  // namespace hil::run
