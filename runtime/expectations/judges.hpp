#pragma once
// The judges of all expectations of a run.
//
// A tick has two parts: first every frame that came since the tick before is an instant of its own, then the
// tick is. At a frame a signal that is not in it has the value of the instant before.
//
// Threads: check_frames and check from the base thread, where they neither allocate nor block; fill after the
// run.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/expectations/kinds.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::expectations {

/// Signals that are computed from others: the variables of a run. Each has a number, above those from which
/// it is computed.
class ComputedSignals {
 public:
  virtual ~ComputedSignals() = default;
  /// The numbers of those that are computed from the signals, also by way of others, ascending.
  virtual std::vector<std::uint32_t> numbers_reading(std::span<const signals::SignalId> signals) const = 0;
  /// The signals, and those from which computed ones among them are computed, each once.
  virtual std::vector<signals::SignalId> with_sources(std::vector<signals::SignalId> signals) const = 0;
  /// Computes those with these numbers at a frame before the tick. Neither allocates nor blocks.
  virtual void update_at_frame(signals::SignalTable& table, std::int64_t time_ns,
                               std::span<const std::uint32_t> numbers) noexcept = 0;
};

class Judges {
 public:
  /// All outlive it. `arrivals` keeps what the devices keep of every frame. `variables`: computed at frames.
  Judges(const config::Scenario& scenario, const signals::SignalTable& table, Arrivals& arrivals,
         ComputedSignals& variables);

  /// In every tick, before the variables of the tick are computed.
  void check_frames(std::int64_t time_ns) noexcept;
  /// In every tick, after that.
  void check(const signals::SignalTable& table, std::int64_t time_ns) noexcept;

  /// Adds the results and the response times.
  void fill(const Extent& extent, report::RunRecord& record) const;

 private:
  struct Judged {
    std::unique_ptr<Judge> judge;
    std::vector<signals::ReadObserver*> observers;  ///< of the signals that it reads
    std::uint64_t last_frame = 0;                   ///< number of the last frame that it judged
  };
  /// What a frame with a signal changes.
  struct Readers {
    std::vector<std::uint32_t> judges;
    std::vector<std::uint32_t> variables;
  };
  void check_frame(const Arrival& frame, std::int64_t time_ns) noexcept;

  Arrivals& arrivals_;
  ComputedSignals& variables_;
  std::vector<Judged> judges_;
  std::vector<Readers> readers_;              ///< by index of the signal
  std::vector<std::uint32_t> due_variables_;  ///< of a frame
  signals::SignalTable at_frame_;             ///< the values at the last frame
  std::span<const Arrival> arrived_;          ///< since the tick before
  std::uint64_t frames_ = 0;
  std::int64_t last_ns_ = 0;  ///< of the last instant
};

}  // namespace hil::expectations
