#pragma once
// Bounds receive times by the order of the bus: a frame that follows a frame of this station was not on the
// bus before that was sent. Receive times are computed from two clocks and can be early by the time between
// two readings.
//
// Threads: one at a time.

#include <linux/can.h>

#include <array>
#include <cstddef>
#include <limits>

#include "io/device.hpp"

namespace hil::io::can {

class SendOrder {
 public:
  /// Notes that a frame with this identifier was sent. Keeps the newest 256 frames that have not been
  /// received back.
  void sent(canid_t id, RunTimeNs send_ns) noexcept {
    waiting_[(first_ + count_) % waiting_.size()] = {id, send_ns};
    if (count_ < waiting_.size()) {
      ++count_;
    } else {
      first_ = (first_ + 1) % waiting_.size();
    }
  }
  /// Notes that a frame of this station with this identifier was received back.
  void received_back(canid_t id) noexcept {
    for (std::size_t i = 0; i < count_; ++i) {
      const Sent& sent = waiting_[(first_ + i) % waiting_.size()];
      if (sent.id != id) continue;
      earliest_ns_ = sent.send_ns;
      first_ = (first_ + i + 1) % waiting_.size();
      count_ -= i + 1;
      return;
    }
  }
  /// A lower bound on the bus time of the next frame of another station.
  RunTimeNs earliest_ns() const noexcept { return earliest_ns_; }

 private:
  struct Sent {
    canid_t id = 0;
    RunTimeNs send_ns = 0;
  };
  std::array<Sent, 256> waiting_{};  ///< a ring
  std::size_t first_ = 0, count_ = 0;
  RunTimeNs earliest_ns_ = std::numeric_limits<RunTimeNs>::min();
};

}  // namespace hil::io::can
