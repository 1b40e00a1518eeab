#pragma once
// Turns the records of the tick into histograms, deadline misses with their causes, and a trace. In real time
// an ordinary thread does this concurrently with the run; it also detects pauses of the host
// (host_pause_detector.hpp). Under the virtual clock there is no such thread: the base thread drains the
// rings when they are half full, so no record is ever lost.

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "runtime/executive/host_pause_detector.hpp"
#include "runtime/executive/probe.hpp"
#include "runtime/executive/records.hpp"
#include "runtime/executive/result.hpp"
#include "runtime/executive/spsc_ring.hpp"
#include "runtime/executive/task_account.hpp"

namespace hil::executive {

struct AccountingOptions {
  /// Records per thread's ring. A full ring drops records and counts them. The default holds about 3 s of 10
  /// tasks at 1 kHz.
  std::size_t records_per_thread = 32'768;
  std::size_t max_misses_per_task = 1'000;  ///< and skips in the report; further ones are only counted
  /// Length of the trace, from the end of the run backwards; 0: no trace
  std::int64_t trace_ns = 10'000'000'000;
};

/// Holds the last `capacity` elements.
template <typename Thing>
class LastOnes {
 public:
  explicit LastOnes(std::size_t capacity) : things_(capacity) {}
  void put(const Thing& thing) noexcept {
    if (things_.empty()) return;
    things_[count_ % things_.size()] = thing;
    ++count_;
  }
  std::vector<Thing> in_order() const {
    std::vector<Thing> ordered;
    const std::uint64_t first = count_ > things_.size() ? count_ - things_.size() : 0;
    for (std::uint64_t at = first; at < count_; ++at)
      ordered.push_back(things_[at % things_.size()]);
    return ordered;
  }

 private:
  std::vector<Thing> things_;
  std::uint64_t count_ = 0;
};

class Accounting {
 public:
  using Slots = std::vector<std::unique_ptr<TaskSlot>>;

  Accounting(const AccountingOptions& options, const Slots& slots, std::int64_t base_period_ns,
             const Probe& probe);
  ~Accounting();
  Accounting(const Accounting&) = delete;
  Accounting& operator=(const Accounting&) = delete;

  /// Before start(): adds the ring of a task's thread.
  void add_ring(SpscRing<RunRecord>& runs) { rings_.push_back(&runs); }

  /// The ring of the base thread.
  SpscRing<RunRecord>& base_runs() noexcept { return base_runs_; }
  SpscRing<TickRecord>& base_ticks() noexcept { return base_ticks_; }

  /// Starts a thread that reads the rings.
  void start();
  /// Reads the available records. Only while no thread was started.
  void drain();
  /// Stops the thread and reads the remaining records. No thread may write any more.
  void finish();

  /// After finish(). `start_ns` is the clock at run time 0.
  void write_into(RunResult& result, const Slots& slots, std::int64_t start_ns) const;

 private:
  void serve();
  void take_run(const RunRecord& run);
  void take_tick(const TickRecord& tick);
  MissCause cause_of_skip(const TickRecord& tick) const noexcept;
  void look_at_steal();

  SpscRing<RunRecord> base_runs_;
  SpscRing<TickRecord> base_ticks_;
  const Probe& probe_;
  const AccountingOptions options_;
  std::vector<SpscRing<RunRecord>*> rings_;
  std::vector<TaskAccount> tasks_;
  BaseResult base_;
  TickRecord last_tick_;
  LastOnes<RunRecord> last_runs_;
  LastOnes<TickRecord> last_ticks_;
  HostPauseDetector pause_detector_;
  bool steal_is_fresh_ = false;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace hil::executive
