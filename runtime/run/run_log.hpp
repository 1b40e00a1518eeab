#pragma once
// What happens around a run, in words with the time on the wall: run.log in the run's folder and, when asked,
// the console. What was opened and how, what programs were started, what became faulty and recovered, why it
// ended.
//
// Threads: any but those of the tick; each line reaches the file at once.

#include <filesystem>
#include <memory>
#include <string>

namespace spdlog {
class logger;
}

namespace hil::run {

class RunLog {
 public:
  /// Throws io::DeviceError when the file can not be written.
  RunLog(const std::filesystem::path& file, bool to_console, bool anew = true);

  void info(const std::string& sentence);
  /// Something is not as it should be; the run goes on, or says elsewhere why not.
  void warn(const std::string& sentence);

 private:
  std::shared_ptr<spdlog::logger> logger_;
};

}  // namespace hil::run
