#pragma once
// The processes that a run starts (the device under test, simulated units), and the ordinary thread that
// watches them while the run goes on.
//
// Threads: construction and stop on one ordinary thread that outlives the processes, since the kernel ends
// a child with the thread that started it.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "io/virtual/process.hpp"

namespace hil::run {

/// How a process ended.
struct ProcessExit {
  std::string name;
  std::string command;
  bool ended_early = false;      ///< it ended before the run
  std::int64_t ended_at_ns = 0;  ///< run time, when ended_early
  std::string exit{};            ///< in words: "exit code 0", "running"
  bool safe_on_exit = true;      ///< its early end ends the run
  bool may_be_lost = false;      ///< its early end does not make the run fail
  std::string fault{};           ///< the fault of the scenario that killed it; empty: none
  /// The last lines of its output, if it ended early and not by a fault, without control characters.
  std::vector<std::string> last_lines{};
  std::string output_fault{};  ///< why its output file is incomplete; empty: it is complete
};

class ProcessWatch {
 public:
  struct Program {
    io::process::ChildConfig child;
    bool safe_on_exit = true;
    bool may_be_lost = false;
  };
  using RunTimeNow = std::function<std::int64_t()>;

  /// Starts all programs, in order. Throws io::DeviceError when one can not be started, and stops those
  /// that were started before.
  ProcessWatch(const std::vector<Program>& programs, RunTimeNow now_ns);
  ~ProcessWatch();
  ProcessWatch(const ProcessWatch&) = delete;
  ProcessWatch& operator=(const ProcessWatch&) = delete;

  /// The id of a process by its place in the list of programs. Neither allocates nor blocks.
  pid_t process_at(std::size_t program) const noexcept { return watched_[program].child->pid(); }
  /// Stops a process (SIGSTOP), by its place in the list of programs, or lets it go on. Any thread; neither
  /// allocates nor blocks.
  void set_paused(std::size_t program, bool paused) noexcept;
  /// Whether a fault has killed it. Base thread.
  bool is_killed(std::size_t program) const noexcept {
    return watched_[program].fault->load(std::memory_order_relaxed) != nullptr;
  }
  /// Kills a process for a fault, whose name outlives the watch: its end does not end the run, and has the
  /// time of this call. As set_paused.
  void kill_for_fault(std::size_t program, const std::string& fault) noexcept;

  /// A text for each process: name, process id and command.
  std::vector<std::string> started() const;
  /// The id of a process, and of its process group; -1: there is no such process.
  pid_t process_of(const std::string& name) const;
  /// Ends the watch in its destructor.
  class [[nodiscard]] Watching {
   public:
    explicit Watching(ProcessWatch& watch) noexcept : watch_(watch) {}
    ~Watching() { watch_.end_watch(); }
    Watching(const Watching&) = delete;
    Watching& operator=(const Watching&) = delete;

   private:
    ProcessWatch& watch_;
  };
  /// Until the result is destroyed, a thread calls `on_exit` for each process that ends, and `every_second`
  /// once a second. What the two refer to lives longer.
  Watching watch(std::function<void(const ProcessExit&)> on_exit, std::function<void()> every_second);
  /// Ends the watch. The processes run on; one that ends later does not count as ended early.
  void end_watch();
  /// Ends the watch as soon as a process with safe_on_exit has ended, at the latest after `timeout`. The
  /// connections of a process close shortly before its exit can be seen.
  void end_watch_after_exit(std::chrono::milliseconds timeout);
  /// Ends the watch, then the processes. Returns how each ended, in their order.
  std::vector<ProcessExit> stop();
  /// The name of the first process that has ended; empty: all run.
  std::string first_ended();

 private:
  void serve();
  void check_children();

  struct Watched {
    std::unique_ptr<io::process::Child> child;
    ProcessExit exit;
    std::filesystem::path output_file;
    std::int64_t killed_at_ns = 0;  ///< by the fault; written before it
    /// The fault that killed it.
    std::unique_ptr<std::atomic<const std::string*>> fault{};
  };
  static void take_fault(Watched& watched);
  RunTimeNow now_ns_;
  std::vector<Watched> watched_;
  std::function<void(const ProcessExit&)> on_exit_;
  std::function<void()> every_second_;
  int wake_ = -1;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace hil::run
