#pragma once
// Random numbers of a stimulus or a fault, from its seed.
//
// Threads: one at a time.

#include <cmath>
#include <cstdint>
#include <numbers>

#include <hil/splitmix64.hpp>

namespace hil::injection {

class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint64_t seed) : state_(seed) {}

  /// In [0, 1).
  double uniform() noexcept {
    state_ += modules::splitmix64_step;
    return static_cast<double>(modules::splitmix64_finalizer(state_) >> 11) * 0x1p-53;
  }
  /// Mean 0, deviation 1 (Box and Muller).
  double normal() noexcept {
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  std::uint64_t state_;
};

}  // namespace hil::injection
