#pragma once
// The accounting of one task: its histograms and deadline misses, from the records of its runs in order.

#include <cstdint>
#include <vector>

#include "runtime/executive/host_pause_detector.hpp"
#include "runtime/executive/records.hpp"
#include "runtime/executive/result.hpp"
#include "runtime/executive/task_slot.hpp"

namespace hil::executive {

class TaskAccount {
 public:
  TaskAccount(const TaskSlot& slot, std::int64_t base_period_ns, std::size_t max_misses);

  bool is_late(const RunRecord& run) const noexcept {
    return run.not_started || run.finish_ns - run.release_ns > result_.deadline_ns;
  }
  void take(const RunRecord& run, const HostPauseDetector& pause_detector);
  /// The result, with the counters of `slot`.
  TaskResult result(const TaskSlot& slot) const;

 private:
  void note_miss(const RunRecord& run, const DelayParts& parts);
  DelayParts explain(const RunRecord& run, const HostPauseDetector& pause_detector) const noexcept;
  void measure(const RunRecord& run) noexcept;

  TaskResult result_;
  std::int64_t budget_ns_;
  std::size_t max_misses_;
  // The previous run, for which the next one may have to wait.
  std::int64_t last_finish_ns_ = 0;
  MissCause last_cause_ = MissCause::own_work;
};

}  // namespace hil::executive
