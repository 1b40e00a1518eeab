#pragma once
// Programs as a user or a CI job starts them: a command line, two streams, signals, an exit code.

#include <sys/types.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/eventually.hpp"

namespace hil::scenario_test {

using Environment = std::vector<std::pair<std::string, std::string>>;

/// How a program ended.
struct Ended {
  int code = -1;  ///< exit code; 128 plus the number of the signal that ended it; -1: not within the limit
  std::string output;
  std::string errors;
  std::chrono::duration<double> took{};  ///< from its start, or from the wait that collected it
};

/// A running program, killed by the destructor when it still runs.
class Program {
 public:
  explicit Program(const std::vector<std::string>& command, const Environment& environment = {});
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  pid_t pid() const noexcept { return pid_; }
  bool running();
  void signal(int number) const;
  /// A child process by its program's name, when it has started; empty when none starts.
  std::optional<pid_t> child(const std::string& name);
  /// Kills the program and fails the test when it does not end within the limit.
  Ended wait(std::chrono::seconds limit = std::chrono::seconds(150));

 private:
  bool try_collect();

  pid_t pid_ = -1;
  std::optional<int> status_;
  std::filesystem::path output_, errors_;
  std::chrono::steady_clock::time_point began_;
};

/// The words of a running program's command line.
std::vector<std::string> command_line(pid_t pid);

using tests::eventually;

}  // namespace hil::scenario_test
