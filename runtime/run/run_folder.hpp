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
  /// Makes the folder when it is missing, locks it against other runs, and clears away the results of an earlier run
  /// (report, junit.xml, trace, pictures, world.json, the database's log), so that nobody takes them for this run's. Other
  /// files stay. Throws io::DeviceError when the folder can not be had, or files that are no run's lie among the log's.
  explicit RunFolder(const std::filesystem::path& directory);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

 private:
  int lock_ = -1;
};

}  // namespace hil::run
