#pragma once
// Turns the records of the tick into histograms, misses with their causes, and a trace. An ordinary thread
// does it beside the run, and is at the same time the witness of pauses (host_stall_detector.hpp); under the virtual
// clock there is no such thread and the base thread drains the rings itself when they are half full, so no
// record is ever lost there.

#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "runtime/executive/host_stall_detector.hpp"
#include "runtime/executive/probe.hpp"
#include "runtime/executive/records.hpp"
#include "runtime/executive/result.hpp"
#include "runtime/executive/spsc_ring.hpp"
#include "runtime/executive/task_account.hpp"

namespace hil::executive {

struct AccountingOptions {
  /// Each thread's ring; a full ring loses records and counts them. The default holds about 3 s of 10 tasks
  /// at 1 kHz.
  std::size_t records_per_thread = 32'768;
  std::size_t kept_misses_per_task = 1'000;  ///< and skips; the counters go on
  std::int64_t trace_ns = 10'000'000'000;    ///< run time the trace reaches back from the end; 0: no trace
};

/// The last `capacity` things that were put in.
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

  /// Before start(): a task's thread writes here.
  void read_also(SpscRing<RunRecord>& runs) { rings_.push_back(&runs); }

  /// The base thread writes here.
  SpscRing<RunRecord>& base_runs() noexcept { return base_runs_; }
  SpscRing<TickRecord>& base_ticks() noexcept { return base_ticks_; }

  /// Reads the rings on a thread of its own from now on.
  void start();
  /// Reads what is there. Only while no thread of its own does.
  void drain();
  /// Ends the thread and reads the rest. Nobody may write any more.
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
  HostStallDetector witness_;
  bool steal_is_fresh_ = false;

  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace hil::executive
