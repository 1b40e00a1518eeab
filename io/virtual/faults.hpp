#pragma once
// Injects faults into the frames of a virtual bus, drawn from a seed: the same seed and frames give the same
// faults.

#include <cstdint>
#include <random>

#include "io/can/can_counters.hpp"
#include "io/can/can_transport.hpp"
#include "io/can/frame.hpp"

namespace hil::io::virtual_bus {

struct FaultConfig {
  /// The bus never carries the frame: no station receives it, no log contains it
  double drop_probability = 0.0;
  double corrupt_probability = 0.0;  ///< one bit of the payload is inverted
  double delay_probability = 0.0;    ///< the frame is delivered delay_ns later
  std::int64_t delay_ns = 0;         ///< at least 0
  std::uint64_t seed = 0;
};

/// Threads: one thread decides, any thread reads the counts.
class FaultInjector {
 public:
  explicit FaultInjector(const FaultConfig& config) : config_(config), random_(config.seed) {}

  enum class FaultOutcome : std::uint8_t { deliver, drop, delay };

  /// Decides what happens to one frame, of this station (`own`) or of another one, and may corrupt it. Draws
  /// four numbers per frame whatever the probabilities, so that a changed probability leaves the other faults
  /// unchanged.
  FaultOutcome decide(can::Frame& frame, bool own) noexcept {
    const bool drop = draw() < config_.drop_probability;
    const bool corrupt = draw() < config_.corrupt_probability;
    const bool delay = draw() < config_.delay_probability;
    const std::uint64_t bit = random_();
    if (drop) {
      count_lost(own);
      return FaultOutcome::drop;
    }
    if (corrupt && frame.raw.len > 0 && !frame.is_remote()) {
      corrupted_.add();
      frame.is_altered = true;
      const std::uint64_t chosen = bit % (8U * frame.raw.len);
      frame.raw.data[chosen / 8] ^= static_cast<std::uint8_t>(1U << (chosen % 8));
    }
    if (delay && config_.delay_ns > 0) {
      delayed_.add();
      return FaultOutcome::delay;
    }
    return FaultOutcome::deliver;
  }

  std::int64_t delay_ns() const noexcept { return config_.delay_ns; }
  /// Counts a delayed frame that was never delivered as dropped.
  void count_lost(bool own) noexcept { (own ? dropped_tx_ : dropped_rx_).add(); }
  can::InjectedFaults counters() const noexcept {
    return {dropped_tx_.get(), dropped_rx_.get(), corrupted_.get(), delayed_.get()};
  }

 private:
  /// Uniform in [0, 1), from the upper 53 bits. The same on every machine, unlike
  /// std::uniform_real_distribution.
  double draw() noexcept { return static_cast<double>(random_() >> 11U) * 0x1.0p-53; }

  FaultConfig config_;
  std::mt19937_64 random_;
  can::Count dropped_tx_, dropped_rx_, corrupted_, delayed_;
};

}  // namespace hil::io::virtual_bus
