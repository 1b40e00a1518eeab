#pragma once
// The port to every arrival of a device: latch_inputs returns only the newest values of a tick.
//
// Threads: keep_arrivals on the setup thread; next_arrival on the tick thread, without allocation; the
// count on any thread.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "io/run_clock.hpp"

namespace hil::io {

/// The value of an input in an arrival.
struct InputValue {
  std::size_t input = 0;  ///< index into inputs() of the device
  double value = 0.0;
};

/// A frame, or the registers of one request.
struct Arrival {
  RunTimeNs time_ns = 0;
  std::size_t count = 0;  ///< of values
};

/// Arrivals of a device that may wait for the tick, and that a tick takes at most.
inline constexpr std::size_t max_kept_arrivals = 8192;

class ArrivalSource {
 public:
  virtual ~ArrivalSource() = default;
  /// Before the start of the device: keeps each arrival of this input, and of those that come with it, for
  /// next_arrival. False: the device can not.
  virtual bool keep_arrivals(std::size_t input) = 0;
  /// Removes the oldest kept arrival whose values the last latch_inputs had, and copies its values to the
  /// front of `values`, of which there are as many as inputs. Empty: there is none; after stop(), also none
  /// that came later.
  virtual std::optional<Arrival> next_arrival(std::span<InputValue> values) noexcept = 0;
  /// The number of kept arrivals that were lost because they were not taken in time.
  virtual std::uint64_t lost_arrivals() const noexcept = 0;
};

}  // namespace hil::io
