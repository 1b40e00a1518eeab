#pragma once
// The judges of all expectations of a run.
//
// A tick has two parts: first every frame whose values are new to it is an instant of its own, then the tick
// is. At a frame a signal that is not in it has the value of the instant before.
//
// Threads: check_frames and check from the base thread, where they neither allocate nor block; fill after the
// run.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/expectations/computed_signals.hpp"
#include "runtime/expectations/kinds.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::expectations {

class Judges {
 public:
  /// The arguments outlive it. `arrivals` keeps what the devices keep of every frame. `variables`: computed
  /// at frames.
  Judges(const config::Scenario& scenario, const signals::SignalTable& table, Arrivals& arrivals,
         ComputedSignals& variables);

  /// Judges the frames whose values the tick has and the one before had not. Call in every tick, before the
  /// variables are computed. `time_ns`: run time of the tick.
  void check_frames(std::int64_t time_ns) noexcept;
  /// Judges the frames of the run that no tick had. Call after the devices are stopped, with the run time of
  /// the end.
  void check_last_frames(std::int64_t end_ns) noexcept;
  /// Judges the tick. Call after check_frames and the variables.
  void check(const signals::SignalTable& table, std::int64_t time_ns) noexcept;

  /// Adds the results and the response times.
  void fill(const Extent& extent, report::RunRecord& record) const;

 private:
  struct JudgeEntry {
    std::unique_ptr<Judge> judge;
    std::vector<signals::ReadObserver*> observers;  ///< of the signals that it reads
    std::uint64_t last_frame = 0;                   ///< number of the last frame that it judged
  };
  /// Judges and variables that read a signal.
  struct Readers {
    std::vector<std::uint32_t> judges;
    std::vector<std::uint32_t> variables;
  };
  void check_frame(const Arrival& frame, std::int64_t time_ns) noexcept;

  Arrivals& arrivals_;
  ComputedSignals& variables_;
  std::vector<JudgeEntry> judges_;
  std::vector<Readers> readers_;              ///< by index of the signal
  std::vector<std::uint32_t> due_variables_;  ///< of a frame
  signals::SignalTable at_frame_;             ///< the values at the last frame
  std::uint64_t frame_number_ = 0;            ///< of the last frame
  std::int64_t last_ns_ = 0;                  ///< of the last instant
};

}  // namespace hil::expectations
