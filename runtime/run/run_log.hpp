#pragma once
// run.log in the folder of a run, and optionally the console: what was opened and started, which devices
// became faulty and recovered, and why the run ended, with wall-clock time.
//
// Threads: any, in real time none of the tick. Each line is written at once.

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

namespace spdlog {
class logger;
}

namespace hil::run {

class RunLog {
 public:
  /// Replaces an existing file, or appends to it. Throws io::DeviceError when the file can not be written.
  RunLog(const std::filesystem::path& file, bool to_console, bool replace = true);

  void info(const std::string& sentence);
  /// What a user waits for: on stderr too, also without --verbose.
  void progress(const std::string& sentence);
  /// For a fault that does not end the run by itself.
  void warn(const std::string& sentence);
  /// Why run.log lacks lines: the first failure to write one. Empty: it lacks none.
  std::string fault() const;

 private:
  std::shared_ptr<spdlog::logger> logger_;
  bool to_console_;
  mutable std::mutex mutex_;
  std::string fault_;  ///< guarded by mutex_
};

}  // namespace hil::run
