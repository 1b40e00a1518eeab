#pragma once
// Programs at the other end of the Modbus devices under test: mbpoll, and child processes.

#include <cstdint>
#include <string>
#include <vector>

#include "io/modbus/tcp_endpoint.hpp"

namespace hil::io::modbus::test {

struct CommandResult {
  int exit_code = -1;
  std::string output;  ///< stdout and stderr
};
CommandResult run_command(const std::string& command);

/// Reads or, with `values`, writes registers of unit 1.
CommandResult mbpoll(std::uint16_t port, const std::string& options, const std::string& values = "");

/// A child process. The constructor waits for its first line of output, the destructor kills it.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command);
  ~Process();
  const std::string& first_line() const { return first_line_; }
  /// The number after the last ':' of the first line.
  std::uint16_t port() const;
  void kill();
  /// SIGTERM, and the exit code.
  int terminate();

 private:
  int pid_ = -1;
  Descriptor output_;
  std::string first_line_;
};

}  // namespace hil::io::modbus::test
