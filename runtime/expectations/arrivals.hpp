#pragma once
// All samples of a device's inputs, for judges that need each of them: a tick sees only the newest of the
// frames that came since the tick before.
//
// Threads: keep from the thread that opens the run, before the device starts; the rest from the base thread,
// lost() also after the run.

#include <cstdint>
#include <span>
#include <vector>

#include "io/device.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

struct Arrival {
  signals::SignalId signal;
  double value = 0.0;
  std::int64_t time_ns = 0;
};

class Arrivals {
 public:
  /// Keeps all samples of this input from now on, if the device can. A second call for a signal has no
  /// effect.
  void keep(io::Device& device, std::size_t input, signals::SignalId signal);
  bool keeps(signals::SignalId signal) const noexcept;

  /// Drops what came before the first tick.
  void begin() noexcept;
  /// The samples since the last call, by signal, each signal's oldest first. Valid until the next call.
  std::span<const Arrival> collect() noexcept;
  /// The number of samples since begin() that were lost since the tick took them too late.
  std::uint64_t lost() const noexcept;

 private:
  struct Kept {
    io::Device* device;
    std::size_t input;
    signals::SignalId signal;
  };
  std::uint64_t lost_by_devices() const noexcept;

  /// Above the capacity of a device. The next call takes what one call leaves.
  static constexpr std::size_t max_per_signal = 8192;
  std::vector<Kept> kept_;
  std::vector<Arrival> collected_;
  std::uint64_t lost_before_ = 0;
};

}  // namespace hil::expectations
