#include "runtime/expectations/arrivals.hpp"

#include <algorithm>

namespace hil::expectations {

void Arrivals::keep(io::Device& device, std::size_t input, signals::SignalId signal) {
  if (keeps(signal) || !device.keep_arrivals(input)) return;
  kept_.push_back({&device, input, signal});
  collected_.reserve(kept_.size() * max_per_signal);
}

bool Arrivals::keeps(signals::SignalId signal) const noexcept {
  return std::any_of(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.signal == signal; });
}

void Arrivals::begin() noexcept {
  collect();
  lost_before_ = lost_by_devices();
}

std::span<const Arrival> Arrivals::collect() noexcept {
  collected_.clear();
  io::Sample sample;
  for (const Kept& kept : kept_) {
    for (std::size_t taken = 0; taken < max_per_signal; ++taken) {
      if (!kept.device->next_arrival(kept.input, sample)) break;
      collected_.push_back({kept.signal, sample.value, sample.time_ns});
    }
  }
  return collected_;
}

std::uint64_t Arrivals::lost() const noexcept {
  return lost_by_devices() - lost_before_;
}

std::uint64_t Arrivals::lost_by_devices() const noexcept {
  std::uint64_t lost = 0;
  for (auto kept = kept_.begin(); kept != kept_.end(); ++kept) {
    const bool counted =
        std::any_of(kept_.begin(), kept, [&](const Kept& other) { return other.device == kept->device; });
    if (!counted) lost += kept->device->lost_arrivals();
  }
  return lost;
}

}  // namespace hil::expectations
