#pragma once
// The folder that a run writes into, its own for as long as it lives.
//
// Threads: one.

#include <filesystem>

namespace hil::run {

/// Where the database writes its log, below what a run leaves.
std::filesystem::path database_folder(const std::filesystem::path& run_folder);

class RunFolder {
 public:
  /// Makes the folder when it is missing and locks it against other runs. Throws io::DeviceError when it can not be had.
  explicit RunFolder(const std::filesystem::path& directory);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// Clears away the results of an earlier run (report, junit.xml, trace, pictures, world.json, the database's log), so that
  /// nobody takes them for this run's. Other files stay. Throws io::DeviceError when that can not be done, or files that are
  /// no run's lie among the log's; the report of the earlier run has gone then all the same.
  void clear() const;
  /// Of them the verdict alone: report.json, report.html and junit.xml. Throws likewise.
  void clear_reports() const;

 private:
  const std::filesystem::path directory_;
  int lock_ = -1;
};

}  // namespace hil::run
