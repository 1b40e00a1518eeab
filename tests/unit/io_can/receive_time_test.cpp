// The age of received frames when the wall clock is set while they wait in the socket.

#include "io/can/receive_time.hpp"

#include <gtest/gtest.h>

namespace hil::io::can {
namespace {

constexpr std::int64_t ms = 1'000'000;
constexpr std::int64_t s = 1000 * ms;

/// A machine whose wall clock can be set.
class Machine {
 public:
  void pass(std::int64_t duration_ns) { now_ns_ += duration_ns; }
  void set_wall_clock_by(std::int64_t step_ns) { offset_ns_ += step_ns; }
  std::int64_t stamp() const { return now_ns_ + offset_ns_; }
  ReceiveTime::Clocks clocks() const { return {now_ns_, stamp()}; }

 private:
  std::int64_t now_ns_ = 5000 * s;
  std::int64_t offset_ns_ = 1'700'000'000 * s;
};

TEST(ReceiveTime, AgeFollowsTheStampWithoutAClockStep) {
  Machine machine;
  ReceiveTime time;
  time.socket_empty(machine.clocks());
  machine.pass(30 * ms);
  const std::int64_t stamp = machine.stamp();
  machine.pass(200 * ms);
  EXPECT_EQ(time.age_ns(stamp, machine.clocks()), 200 * ms);
}

TEST(ReceiveTime, AgeIsCorrectAcrossAClockStep) {
  for (const std::int64_t step : {6 * s, -6 * s, 3600 * s, -3600 * s, 400 * ms, -400 * ms}) {
    Machine machine;
    ReceiveTime time;
    time.socket_empty(machine.clocks());
    machine.pass(30 * ms);
    const std::int64_t before = machine.stamp();
    machine.pass(100 * ms);
    machine.set_wall_clock_by(step);
    machine.pass(50 * ms);
    const std::int64_t after = machine.stamp();
    machine.pass(20 * ms);
    EXPECT_EQ(time.age_ns(before, machine.clocks()), 170 * ms) << step;
    EXPECT_EQ(time.age_ns(after, machine.clocks()), 20 * ms) << step;
    time.socket_empty(machine.clocks());
    machine.pass(10 * ms);
    const std::int64_t later = machine.stamp();
    machine.pass(5 * ms);
    EXPECT_EQ(time.age_ns(later, machine.clocks()), 5 * ms) << step;
  }
}

TEST(ReceiveTime, ClockStepNeverMakesAFrameFresher) {
  for (const std::int64_t step : {6 * s, -6 * s}) {
    Machine machine;
    ReceiveTime time;
    time.socket_empty(machine.clocks());
    machine.pass(10 * s);
    const std::int64_t stamp = machine.stamp();
    machine.pass(1 * s);
    machine.set_wall_clock_by(step);
    machine.pass(9 * s);
    EXPECT_GE(time.age_ns(stamp, machine.clocks()), 10 * s) << step;
  }
}

TEST(ReceiveTime, AgeIsBoundedAcrossTwoClockSteps) {
  Machine machine;
  ReceiveTime time;
  time.socket_empty(machine.clocks());
  machine.set_wall_clock_by(100 * s);
  machine.pass(30 * ms);
  const std::int64_t stamp = machine.stamp();
  machine.set_wall_clock_by(-300 * s);
  machine.pass(20 * ms);
  const std::int64_t age_ns = time.age_ns(stamp, machine.clocks());
  EXPECT_GE(age_ns, 0);
  EXPECT_LE(age_ns, 50 * ms);
}

TEST(ReceiveTime, FutureStampsHaveAgeZero) {
  Machine machine;
  ReceiveTime time;
  time.socket_empty(machine.clocks());
  machine.pass(1 * ms);
  EXPECT_EQ(time.age_ns(machine.stamp() + 100'000, machine.clocks()), 0)
      << "stamp and clock are read at different times";
}

}  // namespace
}  // namespace hil::io::can
