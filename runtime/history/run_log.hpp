#pragma once
// A database's log and what the run that wrote it says of it. Three things tell whether a log is all that was written:
//
//   the log        its checksums, the length that its segments were made with, and the mark that a closed log ends with
//   the report     the version up to which the log was on disk when the run ended
//   neither        of a run that was killed: its log has no mark and there is no report, and where it ends is all that is known
//
// Threads: one; reads files and allocates.

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
  std::string database_id;   ///< that the report is about, by world.json; empty: not known
  std::string report_fault;  ///< why the report can not be read; empty: it can, or there is none
};

/// The log in `directory`, which is a database's, or below a run's folder. Of a database's directory that is the folder 'database' of
/// a run, that run's report counts where both its files can be read. Throws HistoryError (file) where there is no log.
RunLog find_run_log(const std::filesystem::path& directory);

/// Whether the report, if there is one, is about this database.
bool belongs_to(const RunLog& run, std::uint64_t database_id);

/// Empty, or a sentence: versions that were on disk by the report and are not there, with what is there; or that the report can not be read.
std::string missing_versions(const RunLog& run, const rtstdb::HistoryExtent& extent);
/// The same, refused without `salvage`: HistoryError (file) that names that option.
std::string missing_of(const RunLog& run, const rtstdb::HistoryExtent& extent, bool salvage);

/// What there is of a log. Throws HistoryError (file) for damage, with its place and what --salvage would read.
rtstdb::HistoryExtent read_extent(const RunLog& run, bool salvage);

/// Empty for a log that ends with the mark of a closed one, and for a damaged one; else a sentence: where it ends.
std::string not_closed(const rtstdb::HistoryExtent& extent);

/// "version 7 of 1.5 s"
std::string in_words(const rtstdb::VersionInfo& version);

}  // namespace hil::history
