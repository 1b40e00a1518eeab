#pragma once
// Computes the arrival time of a frame from the kernel's timestamp. The timestamp uses CLOCK_REALTIME, which
// may be set while the frame waits in the socket.
//
// A frame arrived after the socket was last empty (or after the previous frame) and before now. age_ns()
// computes its age twice: with the current offset between wall clock and monotonic clock, and with the offset
// at the time when the socket was last empty. It uses the age that lies inside this window, or nearest to it.
// If both lie inside (the clock was set by less than the length of the window), it uses the greater age, so
// that a frame never appears fresher than it is.
//
// Threads: one at a time.

#include <algorithm>
#include <cstdint>

namespace hil::io::can {

class ReceiveTime {
 public:
  /// One instant on both clocks, in nanoseconds.
  struct Clocks {
    std::int64_t monotonic_ns = 0;
    std::int64_t wall_ns = 0;
  };

  /// Notes that the socket is empty or has just been opened.
  void socket_empty(Clocks now) noexcept {
    earliest_ns_ = now.monotonic_ns;
    offset_ns_ = now.wall_ns - now.monotonic_ns;
  }

  /// The age of the frame with this timestamp, at least zero. Frames must be passed in the order of the
  /// socket.
  std::int64_t age_ns(std::int64_t stamp_ns, Clocks now) noexcept {
    const std::int64_t window_ns = std::max<std::int64_t>(now.monotonic_ns - earliest_ns_, 0);
    const std::int64_t by_now_ns = now.wall_ns - stamp_ns;
    const std::int64_t by_then_ns = now.monotonic_ns + offset_ns_ - stamp_ns;
    // The two clocks are read one after the other, and their rates differ by up to 0.05 %.
    const std::int64_t slack_ns = 1'000'000 + window_ns / 1000;
    const auto outside_ns = [&](std::int64_t age_ns) {
      const std::int64_t distance_ns = std::max({-age_ns, age_ns - window_ns, std::int64_t{0}});
      return distance_ns <= slack_ns ? 0 : distance_ns;
    };
    std::int64_t age_ns = std::max<std::int64_t>(by_now_ns, 0);
    if (std::max(by_now_ns, by_then_ns) - std::min(by_now_ns, by_then_ns) > slack_ns) {  // the clock was set
      const auto [newer_ns, older_ns] = std::minmax(by_now_ns, by_then_ns);
      age_ns = std::clamp<std::int64_t>(outside_ns(older_ns) <= outside_ns(newer_ns) ? older_ns : newer_ns, 0,
                                        window_ns);
    }
    earliest_ns_ = now.monotonic_ns - age_ns;
    return age_ns;
  }

 private:
  std::int64_t earliest_ns_ = 0;  ///< monotonic clock; the next frame did not arrive earlier
  std::int64_t offset_ns_ = 0;    ///< wall clock minus monotonic clock when the socket was last empty
};

}  // namespace hil::io::can
