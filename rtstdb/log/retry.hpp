#pragma once
// The time of the next retry of a failed operation. The interval doubles up to a maximum (exponential
// backoff).

#include <algorithm>

#include <rtstdb/time.hpp>

namespace rtstdb::log {

class Retry {
 public:
  Retry(Nanoseconds first, Nanoseconds longest) : first_(first), longest_(longest), interval_(first) {}

  ClockTime at() const noexcept { return at_; }
  void failed(ClockTime now) noexcept {
    at_ = now + interval_;
    interval_ = std::min(interval_ * 2, longest_);
  }
  void succeeded() noexcept {
    at_ = ClockTime::min();
    interval_ = first_;
  }

 private:
  Nanoseconds first_, longest_, interval_;
  ClockTime at_ = ClockTime::min();
};

}  // namespace rtstdb::log
