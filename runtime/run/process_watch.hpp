#pragma once
// The programs that a run starts (the device under test, simulated units) and the ordinary thread that looks
// after them and the console while the run goes on.
//
// Threads: start and stop on one long-lived ordinary thread (the kernel ties a child to the thread that
// started it).

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "io/virtual/process.hpp"

namespace hil::run {

/// How one of them fared.
struct ProcessExit {
  std::string name;
  std::string command;
  bool ended_early = false;
  std::int64_t ended_at_ns = 0;  ///< run time, when ended_early
  std::string exit{};            ///< in words
  bool safe_on_exit = true;      ///< its end ends the run
  bool may_be_lost = false;      ///< its end does not make the run fail
  std::string output_fault{};    ///< why its output file lacks some of what it printed; empty: nothing
};

class ProcessWatch {
 public:
  struct Program {
    io::process::ChildConfig child;
    bool safe_on_exit = true;
    bool may_be_lost = false;
  };
  using RunTimeNow = std::function<std::int64_t()>;

  /// Starts all, in order. Throws io::DeviceError when one can not be started; those started before are
  /// stopped.
  ProcessWatch(const std::vector<Program>& programs, RunTimeNow now_ns);
  ~ProcessWatch();
  ProcessWatch(const ProcessWatch&) = delete;
  ProcessWatch& operator=(const ProcessWatch&) = delete;

  /// Each with its process id and its command.
  std::vector<std::string> started() const;
  /// The process, and process group, of a program; -1: no such program.
  pid_t process_of(const std::string& name) const;
  /// Ends the watch when its scope is left, however it is left.
  class [[nodiscard]] Watching {
   public:
    explicit Watching(ProcessWatch& watch) noexcept : watch_(watch) {}
    ~Watching() { watch_.end_watch(); }
    Watching(const Watching&) = delete;
    Watching& operator=(const Watching&) = delete;

   private:
    ProcessWatch& watch_;
  };
  /// While the answer lives, `on_death` is called, on the watching thread, for each program that ends by
  /// itself, and `every_second` once a second. What they refer to lives longer.
  Watching watch(std::function<void(const ProcessExit&)> on_death, std::function<void()> every_second);
  /// Ends the watch; the programs run on. What ends from here on has ended because the run is over.
  void end_watch();
  /// The same once a program that the run needs has ended by itself, or after this time: one that dies lets go of its connections a moment before
  /// its end can be seen.
  void end_watch_after_an_end(std::chrono::milliseconds at_most);
  /// Ends the watch and then the programs. What became of each, in their order.
  std::vector<ProcessExit> stop();
  /// The first program that has ended already, in words; empty: all run.
  std::string first_ended();

 private:
  void serve();
  void look_at_children();

  struct Watched {
    std::unique_ptr<io::process::Child> child;
    ProcessExit exit_state;
  };
  RunTimeNow now_ns_;
  std::vector<Watched> watched_;
  std::function<void(const ProcessExit&)> on_death_;
  std::function<void()> every_second_;
  int wake_ = -1;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace hil::run
