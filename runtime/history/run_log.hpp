#pragma once
// A database's log, and what the report of the run that wrote it says about it. Whether a log is complete
// follows from:
//
//   the log     its checksums, the allocated length of its segments, and the mark at the end of a closed log
//   the report  the version up to which the log was on disk when the run ended
//
// The log of a killed run has no closing mark and no report; only its last readable version is known.
//
// Threads: one at a time; reads files and allocates.

#include <filesystem>
#include <optional>
#include <string>

#include <rtstdb/history.hpp>

#include "runtime/history/history_error.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::history {

struct RunLog {
  std::filesystem::path log;  ///< the database's directory
  std::optional<report::RunRecord> report;
  std::string database_id;   ///< from world.json; empty: unknown
  std::string report_fault;  ///< why the report can not be read; empty: it can, or there is none
};

/// Finds the log in `directory`, which is a database's directory or a run's folder. For the folder 'database'
/// of a run it also reads the run's report.json and world.json if possible. Throws HistoryError (file) if
/// there is no log.
RunLog find_run_log(const std::filesystem::path& directory);

/// Whether the run's files belong to this database; true if world.json does not say.
bool belongs_to(const RunLog& run, std::uint64_t database_id);

/// The versions that were on disk according to the report but are missing in the log, or why the report can
/// not be read, as a sentence. Empty: neither.
std::string missing_versions(const RunLog& run, const rtstdb::HistoryExtent& extent);
/// The same with the path of the log. Throws it as HistoryError (file) without `salvage`.
std::string missing_of(const RunLog& run, const rtstdb::HistoryExtent& extent, bool salvage);

/// The extent of the log. Throws HistoryError (file) for damage, with its place and what --salvage can read.
rtstdb::HistoryExtent read_extent(const RunLog& run, bool salvage);

/// Where the log ends, as a sentence, if the log was not closed. Empty for a closed or damaged log.
std::string not_closed(const rtstdb::HistoryExtent& extent);

/// "version 7 of 1.5 s"
std::string describe(const rtstdb::VersionInfo& version);

}  // namespace hil::history
