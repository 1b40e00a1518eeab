#pragma once
// The records of the tick: fixed-size structs that the timed threads write into rings and the accounting
// reads. Instants are times of the executive's clock.

#include <cstdint>

namespace hil::executive {

/// One run of one task.
struct RunRecord {
  std::uint32_t task = 0;
  bool warmup = false;
  bool not_started = false;  ///< cancelled at its deadline before its thread had started it
  std::uint64_t tick = 0;
  std::int64_t release_ns = 0;
  std::int64_t base_wake_ns = 0;    ///< end of the base thread's last sleep
  std::int64_t ready_ns = 0;        ///< when the base thread ran it or woke its thread
  std::int64_t thread_free_ns = 0;  ///< when its thread had finished the previous run, of any task
  std::int64_t start_ns = 0;
  std::int64_t finish_ns = 0;
  std::int64_t cpu_ns = 0;
  std::int64_t blocked_ns = 0;
  std::int64_t gpu_ns = 0;
  std::int64_t minor_faults = 0;
  std::int64_t major_faults = 0;
};

/// The stages of a tick, as instants. A tick's frame begins where the previous one ended: at its own release,
/// or at the end of a previous tick that took longer than its period. So wake + begin + publish + tasks + end
/// + idle of consecutive ticks add up to the elapsed time, and for a tick in time to exactly one period.
struct TickRecord {
  std::uint64_t tick = 0;
  std::uint64_t skipped_before = 0;  ///< ticks skipped before this one
  std::int64_t frame_begin_ns = 0;
  std::int64_t base_wake_ns = 0;  ///< end of the base thread's last sleep
  std::int64_t awake_ns = 0;      ///< begin of the tick; the wake-up latency is awake - frame_begin
  std::int64_t begun_ns = 0;      ///< after the begin hook: inputs are latched
  std::int64_t published_ns = 0;  ///< after the outputs of tasks on other threads were published
  std::int64_t worked_ns = 0;     ///< after the tasks
  std::int64_t ended_ns = 0;      ///< after the end hook: outputs are released
  std::int64_t next_ns = 0;       ///< release of the next tick

  std::int64_t frame_end_ns() const noexcept { return ended_ns > next_ns ? ended_ns : next_ns; }
};

}  // namespace hil::executive
