#pragma once
// The log of a database, and what the run that wrote it reports about it. Whether a log is complete is known
// from:
//
//   the log     its checksums, the allocated length of its segments, and the mark at the end of a closed log
//   the report  the version up to which the log was on disk when the run ended
//
// The log of a run that was killed has no closing mark and no report: only its last readable version is
// known.
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
  std::string database_id;   ///< of the run's database, by world.json; empty: not known
  std::string report_fault;  ///< why the report can not be read; empty: it can, or there is none
};

/// The log in `directory`, which is a database's directory or a run's folder. For a directory that is the
/// folder 'database' of a run, the run's report is used where report.json and world.json can be read. Throws
/// HistoryError (file) where there is no log.
RunLog find_run_log(const std::filesystem::path& directory);

/// Whether the run's files are about this database; true where world.json does not say.
bool belongs_to(const RunLog& run, std::uint64_t database_id);

/// A sentence with the versions that were on disk by the report and that the log lacks, or why the report can
/// not be read. Empty: neither.
std::string missing_versions(const RunLog& run, const rtstdb::HistoryExtent& extent);
/// The same, with the path of the log. Without `salvage` throws it as HistoryError (file).
std::string missing_of(const RunLog& run, const rtstdb::HistoryExtent& extent, bool salvage);

/// The extent of the log. Throws HistoryError (file) for damage, with its place and with what --salvage
/// reads.
rtstdb::HistoryExtent read_extent(const RunLog& run, bool salvage);

/// A sentence that says where the log ends, for a log that was not closed. Empty for a closed and for a
/// damaged one.
std::string not_closed(const rtstdb::HistoryExtent& extent);

/// "version 7 of 1.5 s"
std::string in_words(const rtstdb::VersionInfo& version);

}  // namespace hil::history
