#include "runtime/run/loss_watch.hpp"

#include <gtest/gtest.h>

#include "tests/support/allocation_guard.hpp"
#include "tests/support/idle_device.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t ms = 1'000'000;

class WatchedDevice final : public tests::IdleDevice {
 public:
  explicit WatchedDevice(io::RunTimeNs timeout_ns) : IdleDevice("device"), timeout_ns_(timeout_ns) {}
  io::RunTimeNs loss_timeout_ns() const noexcept override { return timeout_ns_; }
  bool connected() const noexcept override { return is_connected; }
  bool is_connected = true;

 private:
  io::RunTimeNs timeout_ns_;
};

void check(LossWatch& watch, std::int64_t from_ms, std::int64_t to_ms) {
  for (std::int64_t time = from_ms; time < to_ms; ++time)
    watch.check(time * ms);
}

TEST(LossWatch, DisconnectionLongerThanTheTimeOutIsALoss) {
  WatchedDevice plc(10 * ms);
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  check(watch, 0, 100);
  plc.is_connected = false;
  check(watch, 100, 110);
  plc.is_connected = true;
  check(watch, 110, 200);
  EXPECT_TRUE(watch.losses(200 * ms, {}).empty());
  plc.is_connected = false;
  check(watch, 200, 211);
  EXPECT_FALSE(watch.outputs_must_be_safe());
  check(watch, 211, 215);
  EXPECT_TRUE(watch.outputs_must_be_safe());
  plc.is_connected = true;
  check(watch, 215, 300);
  EXPECT_FALSE(watch.outputs_must_be_safe());
  const auto losses = watch.losses(300 * ms, {});
  ASSERT_EQ(losses.size(), 1U);
  EXPECT_EQ(losses[0].what, "Modbus unit plc");
  EXPECT_EQ(losses[0].begin_ns, 200 * ms);
  EXPECT_EQ(losses[0].duration_ns, 15 * ms);
  EXPECT_FALSE(losses[0].to_the_end);
  EXPECT_FALSE(losses[0].permitted);
}

TEST(LossWatch, LossInAFaultIsCausedByIt) {
  WatchedDevice plc(10 * ms);
  const std::string name = "cut";
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  check(watch, 0, 100);
  watch.set_fault(0, name, true);
  plc.is_connected = false;
  check(watch, 100, 200);
  EXPECT_FALSE(watch.outputs_must_be_safe());
  watch.set_fault(0, name, false);
  check(watch, 200, 205);
  plc.is_connected = true;
  check(watch, 205, 300);
  const auto losses = watch.losses(300 * ms, {});
  ASSERT_EQ(losses.size(), 1U) << "it came back within its time-out";
  EXPECT_TRUE(losses[0].permitted);
  EXPECT_EQ(losses[0].fault, "cut");
  EXPECT_EQ(losses[0].begin_ns, 100 * ms);
  EXPECT_EQ(losses[0].duration_ns, 100 * ms);
}

TEST(LossWatch, DeviceThatDoesNotComeBackAfterAFaultIsLost) {
  WatchedDevice plc(10 * ms);
  const std::string name = "cut";
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  check(watch, 0, 100);
  watch.set_fault(0, name, true);
  plc.is_connected = false;
  check(watch, 100, 200);
  watch.set_fault(0, name, false);
  check(watch, 200, 250);
  EXPECT_TRUE(watch.outputs_must_be_safe());
  const auto losses = watch.losses(250 * ms, {});
  ASSERT_EQ(losses.size(), 2U);
  EXPECT_TRUE(losses[0].permitted);
  EXPECT_FALSE(losses[1].permitted);
  EXPECT_EQ(losses[1].begin_ns, 200 * ms);
}

TEST(LossWatch, DeviceThatNeverAnsweredIsExcusedOnlyWhileAFaultActs) {
  WatchedDevice plc(1'000 * ms);
  plc.is_connected = false;
  const std::string name = "cut";
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  watch.set_fault(0, name, true);
  check(watch, 0, 50);
  EXPECT_TRUE(watch.losses(50 * ms, {}).empty());
  watch.set_fault(0, name, false);
  check(watch, 50, 100);
  ASSERT_EQ(watch.losses(100 * ms, {}).size(), 1U);
}

TEST(LossWatch, FaultDoesNotExcuseAnEarlierLoss) {
  WatchedDevice plc(10 * ms);
  const std::string name = "cut";
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  check(watch, 0, 100);
  plc.is_connected = false;
  check(watch, 100, 150);
  watch.set_fault(0, name, true);
  check(watch, 150, 200);
  const auto losses = watch.losses(200 * ms, {});
  ASSERT_EQ(losses.size(), 1U);
  EXPECT_FALSE(losses[0].permitted);
}

TEST(LossWatch, DeviceThatNeverConnectsIsLostForTheWholeRun) {
  WatchedDevice plc(1'000 * ms);
  LossWatch never_run({{&plc, "Modbus unit plc", false}});
  EXPECT_TRUE(never_run.losses(0, {}).empty()) << "no tick ran";
  plc.is_connected = false;
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  check(watch, 0, 50);
  ASSERT_EQ(watch.losses(50 * ms, {}).size(), 1U);
  EXPECT_EQ(watch.losses(50 * ms, {})[0].begin_ns, 0);
  EXPECT_EQ(watch.losses(50 * ms, {})[0].duration_ns, 50 * ms);
  EXPECT_TRUE(watch.losses(50 * ms, {})[0].to_the_end);
  plc.is_connected = true;
  check(watch, 50, 51);
  EXPECT_TRUE(watch.losses(51 * ms, {}).empty()) << "shorter than the time-out";
}

TEST(LossWatch, PermittedLossDoesNotSetOutputsToSafeValues) {
  WatchedDevice plc(10 * ms), bus(10 * ms);
  plc.is_connected = false;
  LossWatch watch({{&plc, "Modbus unit plc", true}, {&bus, "CAN bus car", false}});
  check(watch, 0, 50);
  EXPECT_FALSE(watch.outputs_must_be_safe());
  bus.is_connected = false;
  check(watch, 50, 70);
  EXPECT_TRUE(watch.outputs_must_be_safe());
  const auto losses = watch.losses(70 * ms, {});
  ASSERT_EQ(losses.size(), 2U);
  EXPECT_TRUE(losses[0].permitted);
  EXPECT_FALSE(losses[1].permitted);
}

TEST(LossWatch, DeviceWithoutATimeOutIsNeverLost) {
  WatchedDevice server(0);
  server.is_connected = false;
  LossWatch watch({{&server, "Modbus unit hmi", false}});
  check(watch, 0, 5'000);
  EXPECT_TRUE(watch.losses(5'000 * ms, {}).empty());
}

TEST(LossWatch, FirstHundredLossesAreListedAndAllAreCountedWithoutAllocation) {
  WatchedDevice plc(ms);
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (std::int64_t i = 0; i < 150; ++i) {
    plc.is_connected = false;
    check(watch, i * 10, i * 10 + 5);
    plc.is_connected = true;
    check(watch, i * 10 + 5, i * 10 + 10);
  }
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(watch.losses(1'500 * ms, {}).size(), 100U);
  EXPECT_EQ(watch.not_listed(), 50U);
}

TEST(LossWatch, ProcessThatEndsIsALossUnlessItEndsTheRun) {
  WatchedDevice plc(10 * ms);
  LossWatch watch({{&plc, "Modbus unit plc", false}});
  plc.is_connected = false;
  check(watch, 0, 50);
  plc.is_connected = true;
  check(watch, 50, 100);
  const std::vector<ProcessExit> exits{
      {.name = "dut",
       .command = "",
       .ended_early = true,
       .ended_at_ns = 30 * ms,
       .exit = "exited with code 1"},
      {.name = "logger",
       .command = "",
       .ended_early = true,
       .ended_at_ns = 20 * ms,
       .exit = "exited with code 2",
       .safe_on_exit = false,
       .may_be_lost = true},
      {.name = "viewer", .command = "", .exit = "running", .safe_on_exit = false}};
  const auto losses = watch.losses(100 * ms, exits);
  ASSERT_EQ(losses.size(), 2U);
  EXPECT_EQ(losses[0].what, "Modbus unit plc") << "in the order of their begin";
  EXPECT_EQ(losses[1].what, "process logger");
  EXPECT_EQ(losses[1].begin_ns, 20 * ms);
  EXPECT_EQ(losses[1].duration_ns, 80 * ms);
  EXPECT_TRUE(losses[1].to_the_end);
  EXPECT_TRUE(losses[1].permitted);
  EXPECT_EQ(losses[1].cause, "exited with code 2");
}

}  // namespace
}  // namespace hil::run
