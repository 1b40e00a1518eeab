#pragma once
// A child process of the run: the program of a device under test or of a simulated unit.
//
// The child is killed when this process ends, even if this process is killed, and so are the processes that
// the child started, unless they left its process group. The child has a process group of its own, so that
// Ctrl-C in a terminal reaches it only through the run; a guardian process in that group waits for the end of
// this process. The child starts with default signal handling and ordinary scheduling.
//
// Threads: one at a time. The kernel ties the child to the *thread* that started it, so that thread must
// outlive the child (usually the main thread).

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
  std::string name;                  ///< name for messages
  std::vector<std::string> command;  ///< program and arguments
  /// Folders in which a program without '/' in its name is searched before PATH.
  std::vector<std::filesystem::path> search_folders;
  std::filesystem::path working_folder;  ///< empty: that of this process
  /// Receives stdout and stderr, up to 16 MiB (output_keeper.hpp); replaced if it exists; empty: /dev/null.
  std::filesystem::path output_file;
};

/// How a child ended.
struct Exit {
  enum class How : std::uint8_t {
    exited,  ///< `code` is its exit code
    killed,  ///< `code` is the signal
  };
  How how = How::exited;
  int code = 0;
  bool had_to_be_killed = false;  ///< it did not end in time after SIGTERM

  bool success() const noexcept { return how == How::exited && code == 0; }
  bool operator==(const Exit&) const = default;
};

/// The executable file with this name, without '/', in one of the folders, or else in one of PATH; empty:
/// there is none.
std::string find_program(const std::string& name, std::vector<std::filesystem::path> folders);

/// "exited with code 3", "was ended by signal 11 (Segmentation fault)".
std::string describe(const Exit& exit);

class Child {
 public:
  /// Starts the program. Throws DeviceError when it is not found or can not be run.
  explicit Child(const ChildConfig& config);
  /// Stops it, with one second after SIGTERM.
  ~Child();
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;

  const std::string& name() const noexcept { return name_; }
  pid_t pid() const noexcept { return pid_; }
  /// Becomes readable when the child ends. Valid as long as this object lives.
  int exit_fd() const noexcept { return pidfd_.get(); }

  /// Never blocks.
  bool running() { return !try_collect(); }
  /// Waits for its end for at most `limit_ns`. False: it still runs.
  bool wait_for_exit(std::int64_t limit_ns);
  /// Sends SIGTERM, then after the limit SIGKILL. Returns at once if the child has ended.
  const Exit& stop(std::int64_t limit_ns);
  /// Misuse (asserts): the child runs.
  const Exit& exit() const;
  /// After the end: why the output file lacks a part of the output (OutputKeeper::fault).
  std::string output_fault() const { return output_ ? output_->fault() : std::string(); }

 private:
  /// True when the child has ended.
  bool try_collect();
  /// False: errno holds the reason.
  bool start_guardian();
  void signal_group(int signal) const noexcept;

  std::string name_;
  pid_t pid_ = -1;
  Descriptor pidfd_;
  pid_t guardian_ = -1;
  Descriptor guardian_pipe_;  ///< the guardian holds the other end; no process writes
  std::unique_ptr<OutputKeeper> output_;
  bool ended_ = false;
  Exit exit_;
};

}  // namespace hil::io::process
