#pragma once
// A clock that only the test advances.

#include <rtstdb/time.hpp>

namespace rtstdb::log::test {

class ManualClock final : public Clock {
 public:
  ClockTime now() const noexcept override { return now_; }
  void advance(Nanoseconds by) noexcept { now_ += by; }

 private:
  ClockTime now_ = clock_time_ns(1'000'000'000);
};

}  // namespace rtstdb::log::test
