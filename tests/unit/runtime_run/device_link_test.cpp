// Devices as tasks of the executive, with a fake device.

#include "runtime/run/device_link.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/support/allocation_guard.hpp"
#include "tests/support/idle_device.hpp"
#include "tests/unit/runtime_run/counted_reads.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t ms = 1'000'000;

/// Two inputs and two outputs; records the calls.
class FakeDevice final : public tests::IdleDevice {
 public:
  FakeDevice() : IdleDevice("fake") {}
  std::span<const io::ChannelInfo> inputs() const noexcept override { return channels_; }
  std::span<const io::InputGroup> input_groups() const noexcept override { return groups_; }
  std::span<const io::ChannelInfo> outputs() const noexcept override { return channels_; }
  void latch_inputs(std::span<io::Sample> samples) noexcept override {
    samples[0] = first;
    samples[1] = second;
  }
  void release_outputs(std::span<const double> values, io::RunTimeNs tick_ns) noexcept override {
    released[0] = values[0];
    released[1] = values[1];
    released_at_ns = tick_ns;
    ++releases;
  }
  bool exchange(io::RunTimeNs tick_ns) override {
    exchanged_at_ns = tick_ns;
    released_before_exchange = releases;
    ++exchanges;
    return answers;
  }
  bool connected() const noexcept override { return is_connected; }
  io::SendCycle send_cycle(std::size_t output) const noexcept override {
    return output == 1 ? cycle : io::SendCycle{};
  }

  io::SendCycle cycle;
  io::Sample first, second;
  double released[2] = {-1.0, -1.0};
  std::int64_t released_at_ns = -1, exchanged_at_ns = -1;
  int releases = 0, exchanges = 0, released_before_exchange = 0;
  bool answers = true, is_connected = true;

 private:
  std::vector<io::ChannelInfo> channels_{{.name = "a", .unit = "", .safe_value = -7.0},
                                         {.name = "b", .unit = "", .safe_value = -8.0}};
  std::vector<io::InputGroup> groups_{{.name = "both", .first = 0, .count = 2, .timeout_ns = ms}};
};

class DeviceLinks : public ::testing::Test {
 protected:
  signals::SignalTable table_;
  const signals::SignalId source_ =
      table_.add({.name = "source", .unit = "", .writer = "test", .initial = 6.0});
  const signals::SignalId a_ = table_.add({.name = "fake.a", .unit = "", .writer = "fake"});
  const signals::SignalId b_ = table_.add({.name = "fake.b", .unit = "", .writer = "fake"});
  const signals::SignalId connected_ = table_.add({.name = "fake.connected", .unit = "", .writer = "fake"});
  const signals::SignalId fresh_ = table_.add({.name = "fake.both.fresh", .unit = "", .writer = "fake"});
  FakeDevice device_;
  DeviceLink::Links links_{.inputs = {b_, a_},
                           .outputs = {{.signal = {}, .constant = 4.0}, {.signal = source_}},
                           .connected = connected_,
                           .fresh = {fresh_}};
};

TEST_F(DeviceLinks, NoteThatTheyReadWhenAFrameIsDue) {
  test::CountedReads reads;
  table_.add_read_observer(source_, reads);
  device_.cycle = {.period_ns = 20 * ms, .offset_ns = 5 * ms};
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  std::string due;
  for (const int at_ms : {0, 10, 20, 30, 60, 64, 65}) {
    const int before = reads.count;
    link.step({.time_ns = at_ms * ms});
    if (reads.count > before) due += std::to_string(at_ms) + " ";
  }
  EXPECT_EQ(due, "10 30 60 65 ") << "frames of 5, 25, 45 and 65 ms";
  link.hold_safe_values(true);
  link.step({.time_ns = 90 * ms});
  EXPECT_EQ(reads.count, 4) << "the safe values are sent";
}

TEST_F(DeviceLinks, NoteThatTheyReadWithEachReleaseOfAnOutputWithoutACycle) {
  test::CountedReads reads;
  table_.add_read_observer(source_, reads);
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  for (const int at_ms : {0, 1, 2})
    link.step({.time_ns = at_ms * ms});
  EXPECT_EQ(reads.count, 3);
}

TEST_F(DeviceLinks, WriteInputsToSignalsWithTheirTimes) {
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  device_.first = {.value = 5.0, .time_ns = 1'234, .fresh = true};
  device_.second = {.value = -2.0, .time_ns = 99, .fresh = false};
  link.latch_inputs(0);
  EXPECT_DOUBLE_EQ(table_.value(b_), 5.0);
  EXPECT_EQ(table_.read(b_).time_ns, 1'234);
  EXPECT_TRUE(table_.read(b_).fresh);
  EXPECT_DOUBLE_EQ(table_.value(a_), -2.0);
  EXPECT_EQ(table_.read(a_).time_ns, 99);
  EXPECT_FALSE(table_.read(a_).fresh);
}

TEST_F(DeviceLinks, WriteConnectionAndFreshnessToSignals) {
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  link.latch_inputs(3 * ms);
  EXPECT_EQ(table_.value(connected_), 1.0);
  EXPECT_EQ(table_.value(fresh_), 0.0) << "nothing has arrived";
  EXPECT_EQ(table_.read(fresh_).time_ns, 3 * ms);
  device_.second.fresh = true;
  device_.is_connected = false;
  link.latch_inputs(4 * ms);
  EXPECT_EQ(table_.value(connected_), 0.0);
  EXPECT_EQ(table_.value(fresh_), 1.0) << "one input of the group is enough";
  EXPECT_TRUE(table_.read(fresh_).fresh && table_.read(connected_).fresh);
}

TEST_F(DeviceLinks, HoldSafeValuesUntilTheyAreReleased) {
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  link.hold_safe_values(true);
  link.step({.tick = 3, .time_ns = 3 * ms, .period_ns = ms, .run = 3});
  EXPECT_DOUBLE_EQ(device_.released[0], -7.0);
  EXPECT_DOUBLE_EQ(device_.released[1], -8.0);
  link.hold_safe_values(false);
  link.step({.tick = 4, .time_ns = 4 * ms, .period_ns = ms, .run = 4});
  EXPECT_DOUBLE_EQ(device_.released[0], 4.0);
  EXPECT_DOUBLE_EQ(device_.released[1], 6.0);
}

TEST_F(DeviceLinks, ReadOutputsFromSignalsAndConstants) {
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  link.step({.tick = 3, .time_ns = 3 * ms, .period_ns = ms, .run = 3});
  EXPECT_DOUBLE_EQ(device_.released[0], 4.0);
  EXPECT_DOUBLE_EQ(device_.released[1], 6.0);
  EXPECT_EQ(device_.released_at_ns, 3 * ms);
  table_.write(source_, 8.0, 4 * ms);
  link.step({.tick = 4, .time_ns = 4 * ms, .period_ns = ms, .run = 4});
  EXPECT_DOUBLE_EQ(device_.released[1], 8.0);
  EXPECT_EQ(device_.exchanges, 0) << "there is no exchange in real time";
  EXPECT_TRUE(link.in_step());
}

TEST_F(DeviceLinks, AnOutputWhoseSignalIsUnknownKeepsItsValue) {
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  table_.write(source_, std::nan(""), 0);
  link.step({});
  EXPECT_EQ(device_.released[1], -8.0) << "the safe value before the first known one";
  table_.write(source_, 8.0, ms);
  link.step({});
  table_.write(source_, std::nan(""), ms);
  link.step({});
  EXPECT_EQ(device_.released[1], 8.0);
}

TEST_F(DeviceLinks, ConvertSignalsToTheUnitsOfOutputs) {
  links_.outputs[1].conversion = {.numerator = 18.0, .denominator = 5.0};
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  link.step({.tick = 3, .time_ns = 3 * ms, .period_ns = ms, .run = 3});
  EXPECT_DOUBLE_EQ(device_.released[0], 4.0) << "a constant is in the output's unit";
  EXPECT_DOUBLE_EQ(device_.released[1], 21.6);
}

TEST_F(DeviceLinks, ExchangeAfterTheReleaseInLockStep) {
  DeviceLink link(device_, links_, table_, io::Pacing::lockstep);
  link.step({.tick = 5, .time_ns = 5 * ms, .period_ns = ms, .run = 5});
  EXPECT_EQ(device_.exchanges, 1);
  EXPECT_EQ(device_.exchanged_at_ns, 5 * ms);
  EXPECT_EQ(device_.released_before_exchange, 1);
  EXPECT_TRUE(link.in_step());
}

TEST_F(DeviceLinks, DoNotWaitAgainForADeviceThatDidNotReply) {
  DeviceLink link(device_, links_, table_, io::Pacing::lockstep);
  device_.answers = false;
  link.step({});
  EXPECT_FALSE(link.in_step());
  device_.answers = true;
  link.step({});
  EXPECT_FALSE(link.in_step());
  EXPECT_EQ(device_.exchanges, 1);
}

TEST_F(DeviceLinks, DoNotAllocateInTheTick) {
  DeviceLink link(device_, links_, table_, io::Pacing::realtime);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  link.latch_inputs(0);
  link.step({});
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::run
