#pragma once
// Faults that a virtual bus puts on its frames, drawn from a seed: the same seed and frames give the same
// faults.

#include <cstdint>
#include <random>

#include "io/can/frame.hpp"

namespace hil::io::virtual_bus {

struct FaultConfig {
  double drop_probability = 0.0;     ///< the frame never was on the bus
  double corrupt_probability = 0.0;  ///< one bit of the payload is inverted
  double delay_probability = 0.0;    ///< the frame comes delay_ns later
  std::int64_t delay_ns = 0;         ///< at least 0
  std::uint64_t seed = 0;
};

struct FaultCounters {
  std::uint64_t dropped = 0;
  std::uint64_t corrupted = 0;
  std::uint64_t delayed = 0;
};

/// Threads: one.
class FaultInjector {
 public:
  explicit FaultInjector(const FaultConfig& config) : config_(config), random_(config.seed) {}

  enum class Fate : std::uint8_t { deliver, drop, delay };

  /// Decides over one frame and may corrupt it. Draws four numbers for every frame, whatever the
  /// probabilities, so that changing one of them leaves the other faults where they were.
  Fate decide(can::Frame& frame) noexcept {
    const bool drop = draw() < config_.drop_probability;
    const bool corrupt = draw() < config_.corrupt_probability;
    const bool delay = draw() < config_.delay_probability;
    const std::uint64_t bit = random_();
    if (drop) {
      ++counters_.dropped;
      return Fate::drop;
    }
    if (corrupt && frame.raw.len > 0 && !frame.is_remote()) {
      ++counters_.corrupted;
      const std::uint64_t chosen = bit % (8U * frame.raw.len);
      frame.raw.data[chosen / 8] ^= static_cast<std::uint8_t>(1U << (chosen % 8));
    }
    if (delay && config_.delay_ns > 0) {
      ++counters_.delayed;
      return Fate::delay;
    }
    return Fate::deliver;
  }

  std::int64_t delay_ns() const noexcept { return config_.delay_ns; }
  const FaultCounters& counters() const noexcept { return counters_; }

 private:
  /// In [0, 1), from the upper 53 bits: the same on every machine, unlike std::uniform_real_distribution.
  double draw() noexcept { return static_cast<double>(random_() >> 11U) * 0x1.0p-53; }

  FaultConfig config_;
  std::mt19937_64 random_;
  FaultCounters counters_;
};

}  // namespace hil::io::virtual_bus
