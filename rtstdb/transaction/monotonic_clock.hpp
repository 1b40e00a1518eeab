#pragma once
// CLOCK_MONOTONIC as the database's deadline clock.

#include <ctime>

#include <rtstdb/time.hpp>

namespace rtstdb::transaction {

class MonotonicClock final : public Clock {
 public:
  ClockTime now() const noexcept override {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return clock_time_ns(std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec);
  }
};

}  // namespace rtstdb::transaction
