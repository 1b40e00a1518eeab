#pragma once
// A child process of the run: a device under test or a simulated unit that is a program of its own.
//
// The child dies with this process, even when this process is killed, and with it what it has started, unless
// that has left its process group. It has a group of its own, so that Ctrl-C in a terminal reaches it through
// the run and not beside it; a guardian process in that group waits for the end of this process. It starts
// with default signal handling and ordinary scheduling.
//
// Threads: one at a time. The kernel ties the child to the *thread* that started it: that thread must live as
// long as the child is wanted (the main thread, as a rule).

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "io/virtual/descriptor.hpp"
#include "io/virtual/output_keeper.hpp"

namespace hil::io::process {

struct ChildConfig {
  std::string name;                  ///< in messages
  std::vector<std::string> command;  ///< program and arguments
  /// Where a program without '/' in its name is looked for before PATH.
  std::vector<std::filesystem::path> search_folders;
  std::filesystem::path working_folder;  ///< empty: this process's own
  std::filesystem::path output_file;     ///< stdout and stderr, the first 16 MiB (output_keeper.hpp);
                                         ///< replaced; empty: /dev/null
};

/// How a child ended.
struct Exit {
  enum class How : std::uint8_t {
    exited,  ///< `code` is its exit code
    killed,  ///< `code` is the signal
  };
  How how = How::exited;
  int code = 0;
  bool had_to_be_killed = false;  ///< it did not end within the limit after SIGTERM

  bool success() const noexcept { return how == How::exited && code == 0; }
  bool operator==(const Exit&) const = default;
};

/// "exited with code 3", "was ended by signal 11 (Segmentation fault)".
std::string describe(const Exit& exit);

class Child {
 public:
  /// Starts it. Throws DeviceError when the command is not found or can not be run.
  explicit Child(const ChildConfig& config);
  /// Stops it, with one second for SIGTERM.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  const std::string& name() const noexcept { return name_; }
  pid_t pid() const noexcept { return pid_; }
  /// Becomes readable when the child ends. Valid as long as this object lives.
  int exit_fd() const noexcept { return pidfd_.get(); }

  /// Never blocks.
  bool running() { return !try_collect(); }
  /// Waits for its end, at most so long. False: it still runs.
  bool wait_for_exit(std::int64_t limit_ns);
  /// SIGTERM, then after the limit SIGKILL. Returns at once for a child that has ended.
  const Exit& stop(std::int64_t limit_ns);
  /// Misuse (asserts): while it runs.
  const Exit& exit() const;
  /// After the end: why the output file lacks some of what the program printed (OutputKeeper::fault).
  std::string output_fault() const { return output_ ? output_->fault() : std::string(); }

 private:
  /// True when the child has ended, now or before.
  bool try_collect();
  /// False: errno says why.
  bool start_guardian();
  void signal_group(int signal) const noexcept;

  std::string name_;
  pid_t pid_ = -1;
  Descriptor pidfd_;
  pid_t guardian_ = -1;
  Descriptor alive_;  ///< its other end is the guardian's; nobody writes
  std::unique_ptr<OutputKeeper> output_;
  bool ended_ = false;
  Exit exit_;
};

}  // namespace hil::io::process
