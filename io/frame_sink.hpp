#pragma once
// The port to what records the frames of a bus. A type of bus has its own type of frame, which crosses the
// port as its bytes.

#include <cstddef>
#include <cstring>
#include <span>
#include <type_traits>

#include "io/run_clock.hpp"

namespace hil::io {

/// The size of the largest type of frame.
inline constexpr std::size_t max_frame_bytes = 128;

/// Threads: take is called by one thread, the device's own; under the virtual clock the tick.
class FrameSink {
 public:
  virtual ~FrameSink() = default;
  /// `time_ns`: when it was on the bus; negative: before the first tick. `frame` has at most max_frame_bytes.
  /// Neither allocates nor blocks under the real-time clock.
  virtual void take(RunTimeNs time_ns, std::span<const std::byte> frame) noexcept = 0;
};

template <class Frame>
void take_frame(FrameSink& sink, RunTimeNs time_ns, const Frame& frame) noexcept {
  static_assert(std::is_trivially_copyable_v<Frame> && sizeof(Frame) <= max_frame_bytes);
  sink.take(time_ns, std::as_bytes(std::span(&frame, 1)));
}
/// The frame that take_frame() had.
template <class Frame>
Frame frame_of(std::span<const std::byte> bytes) noexcept {
  Frame frame;
  std::memcpy(&frame, bytes.data(), sizeof frame);
  return frame;
}

}  // namespace hil::io
