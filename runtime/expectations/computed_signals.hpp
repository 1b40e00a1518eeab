#pragma once
// Signals that are computed from others at each instant: the variables of a run. They are numbered so that
// each one reads only signals of lower numbers.

#include <cstdint>
#include <span>
#include <vector>

#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

/// Threads: update_at_frame from the base thread; the rest on any.
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

}  // namespace hil::expectations
