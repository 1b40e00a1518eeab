#pragma once
// hil db export: a database's log as JSON Lines, one object per line, in the order of versions.
// docs/guide/history.md lists the kinds of line.

#include <string>

namespace hil::cli {

struct ExportOptions {
  std::string file;  ///< empty: stdout
  bool without_meshes = false;
  bool salvage = false;
};

/// Returns the exit code; faults go to stderr. Throws history::HistoryError before it writes anything: for a
/// directory without a log and, without `salvage`, for a damaged log and for one that lacks versions which
/// were on disk by the run's report.
int export_log(const std::string& directory, const ExportOptions& options);

}  // namespace hil::cli
