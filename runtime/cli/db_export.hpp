#pragma once
// hil db export: a database's log as JSON Lines, one object a line, in the order of versions. README.md tells the lines.

#include <string>

namespace hil::cli {

struct ExportOptions {
  std::string file;  ///< empty: stdout
  bool without_meshes = false;
  bool salvage = false;
};

/// The exit code; what is wrong goes to stderr. Throws history::HistoryError for a directory without a log and, without `salvage`, before
/// it writes anything, for a damaged log and one that lacks versions which the run's report has as written.
int export_log(const std::string& directory, const ExportOptions& options);

}  // namespace hil::cli
