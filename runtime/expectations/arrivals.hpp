#pragma once
// The frames that devices received since the tick before, and what registers were read or written: a tick
// sees only the newest values. They come in one receive order over all devices: by time stamp, then as each
// device received them.
//
// Threads: keep from the thread that opens the run, before the device starts; the rest from the base thread,
// lost() also after the run.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/signals/links.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::expectations {

struct ArrivedValue {
  signals::SignalId signal;
  double value = 0.0;
};

/// A frame, or the registers of one request.
struct Arrival {
  std::int64_t time_ns = 0;
  std::span<const ArrivedValue> values;  ///< also of the signals that tell whether a message is fresh

  std::optional<double> find(signals::SignalId signal) const noexcept {
    for (const ArrivedValue& arrived : values)
      if (arrived.signal == signal) return arrived.value;
    return std::nullopt;
  }
};

class Arrivals {
 public:
  /// Keeps all arrivals of the input with this signal from now on, with all inputs that come with it, if the
  /// device can. `links`: of the device. A second call for a signal has no effect.
  void keep(io::Device& device, const signals::Links& links, signals::SignalId signal);
  bool keeps(signals::SignalId signal) const noexcept;

  /// The first tick begins: what was lost before does not count.
  void begin() noexcept { lost_before_ = lost_by_devices(); }
  /// The arrivals since the last call whose values the devices' last latch had, without those from before the
  /// first tick. Valid until the next call.
  std::span<const Arrival> collect() noexcept;
  /// The one whose instant is judged. Only at an instant of a frame.
  const Arrival& current() const noexcept { return *current_; }
  void set_current(const Arrival& frame) noexcept { current_ = &frame; }
  /// The number of arrivals since begin() that were lost since the tick took them too late.
  std::uint64_t lost() const noexcept;
  /// "1 frame was lost between the bus and the tick". Empty: none was.
  std::string lost_text() const;

 private:
  struct Source {
    io::ArrivalSource* arrivals;
    std::vector<signals::SignalId> inputs;  ///< by input
    std::vector<signals::SignalId> fresh;   ///< by input: of its group; invalid: none
    std::vector<io::InputValue> values;     ///< of `next`
    std::optional<io::Arrival> next;        ///< taken from the device, not collected yet
  };
  Source& source_of(io::Device& device, const signals::Links& links);
  static void take_next(Source& source) noexcept;
  void add(const Source& source) noexcept;
  std::uint64_t lost_by_devices() const noexcept;

  /// Limits of one collect(); the next one takes the rest.
  static constexpr std::size_t max_arrivals = io::max_kept_arrivals, max_values = 16 * max_arrivals;
  std::vector<Source> sources_;
  std::vector<signals::SignalId> kept_;
  std::vector<Arrival> collected_;
  std::vector<ArrivedValue> values_;
  const Arrival* current_ = nullptr;
  std::uint64_t lost_before_ = 0;
};

}  // namespace hil::expectations
