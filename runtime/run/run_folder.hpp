#pragma once
// The folder that a run writes into, locked against other runs.
//
// Threads: one.

#include <filesystem>

namespace hil::run {

/// The folder of the database's log in the folder of a run.
std::filesystem::path database_folder(const std::filesystem::path& run_folder);

/// Throws io::DeviceError when the folder of a run, or one of the folders that a run makes in it, contains a
/// symbolic link, whatever it points to: what is written by its name would change a file or folder elsewhere.
/// A folder that does not exist contains none. `run_folder` itself may be a link.
void require_no_links(const std::filesystem::path& run_folder);

class RunFolder {
 public:
  /// Creates the folder if it is missing, and locks it. Throws io::DeviceError when it can not be created
  /// or locked, or contains a link (require_no_links); then it first removes the reports of an earlier run
  /// that are no links.
  explicit RunFolder(const std::filesystem::path& directory);
  ~RunFolder();
  RunFolder(const RunFolder&) = delete;
  RunFolder& operator=(const RunFolder&) = delete;

  /// Removes the results of an earlier run: report, junit.xml, trace, pictures, world.json, run.log,
  /// recording.mcap, the point clouds, the database's log. Other files stay. Throws io::DeviceError when a
  /// file can not be removed, or when the folder of the log contains files that no run writes; the report of
  /// the earlier run is removed first.
  void clear() const;
  /// Removes report.json, report.html and junit.xml of an earlier run. Throws io::DeviceError.
  void clear_reports() const;

 private:
  const std::filesystem::path directory_;
  int lock_ = -1;
};

}  // namespace hil::run
