#pragma once
// The samples of a device's inputs one by one, for those who have to see each of them: a tick knows only the
// newest of the frames that came since the tick before.
//
// Threads: keep from the thread that opens the run, before the device starts; all else from the base thread,
// and lost() after the run.

#include <cstdint>
#include <span>
#include <vector>

#include "io/device.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::run {

struct Arrival {
  signals::SignalId signal;
  double value = 0.0;
  std::int64_t time_ns = 0;
};

class Arrivals {
 public:
  /// From now on, when the device can; a second time for one signal is no mistake.
  void keep(io::Device& device, std::size_t input, signals::SignalId signal);
  bool keeps(signals::SignalId signal) const noexcept;

  /// Just before the first tick: what came before it is forgotten.
  void begin() noexcept;
  /// What came since it was called last. By signal, each oldest first; valid until the next call.
  std::span<const Arrival> collect() noexcept;
  /// Since begin(): samples that are missing because the tick took them too late.
  std::uint64_t lost() const noexcept;

 private:
  struct Kept {
    io::Device* device;
    std::size_t input;
    signals::SignalId signal;
  };
  std::uint64_t lost_by_devices() const noexcept;

  /// A device keeps less; what one call does not take waits for the next.
  static constexpr std::size_t max_per_signal = 8192;
  std::vector<Kept> kept_;
  std::vector<Arrival> collected_;
  std::uint64_t lost_before_ = 0;
};

}  // namespace hil::run
