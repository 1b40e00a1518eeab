// Faults of frames in a CAN device: what others receive of it, and what it reads of others.

#include <gtest/gtest.h>

#include <set>

#include "driven_bus.hpp"
#include "io/can/can_device.hpp"
#include "tests/support/can_faults.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::can {
namespace {

std::size_t index_of(std::span<const ChannelInfo> channels, const std::string& name) {
  std::size_t index = 0;
  while (index < channels.size() && channels[index].name != name)
    ++index;
  return index;
}

/// The device in lock-step, with ticks of 10 ms. EgoStatus is sent on each.
class FrameFaults : public testing::Test {
 protected:
  std::string add(const std::string& message, const std::string& entry, std::uint64_t seed = 0) {
    return tests::add_can_fault(device_, message, entry, seed);
  }
  void start() { device_.start(clock_, Pacing::lockstep); }

  /// The frames of EgoStatus that the tick sends.
  std::vector<Frame> tick() {
    bus_->sent.clear();
    clock_.set(now_);
    device_.release_outputs(std::vector<double>(device_.outputs().size(), value_), now_);
    EXPECT_TRUE(device_.exchange(now_));
    now_ += 10 * ms;
    std::vector<Frame> frames;
    for (const Frame& frame : bus_->sent) {
      if (frame.raw.can_id == 0x100) frames.push_back(frame);
    }
    return frames;
  }
  std::vector<unsigned> counters(int ticks) {
    std::vector<unsigned> all;
    for (int i = 0; i < ticks; ++i)
      for (const Frame& frame : tick())
        all.push_back(frame.raw.data[4] & 15U);
    return all;
  }
  /// A BrakeCommand of this deceleration arrives with the next tick.
  void arrive(double deceleration) {
    const DbcMessage& message = *database_.find_message("BrakeCommand");
    std::vector<double> values(message.signals.size(), 0.0);
    values[0] = deceleration;
    MessageEncoder::Tally tally;
    Frame frame = encoder_.build(values, tally);
    encoder_.confirm_sent();
    frame.direction = Direction::rx;
    frame.time_ns = now_;
    bus_->arriving.push_back(frame);
  }
  Sample deceleration() {
    std::vector<Sample> samples(device_.inputs().size());
    device_.latch_inputs(samples);
    return samples[index_of(device_.inputs(), "BrakeCommand.Deceleration")];
  }
  static bool has_right_checksum(const Frame& frame) {
    const MessageLayout layout(*crossing_config().database.find_message("EgoStatus"), protection, Use::send);
    return frame.raw.data[7] == layout.checksum_of(frame.payload());
  }

  Dbc database_ = crossing_config().database;
  MessageEncoder encoder_{*database_.find_message("BrakeCommand"), protection};
  DrivenBus* bus_ = new DrivenBus;
  CanDevice device_{crossing_config(), std::unique_ptr<CanTransport>(bus_)};
  SetClock clock_;
  RunTimeNs now_ = 0;
  double value_ = 1.0;  ///< of each output
};

TEST_F(FrameFaults, DropLosesItsShareFromTheSeed) {
  ASSERT_EQ(add("EgoStatus", "drop: 25 %", 7), "");
  start();
  device_.set_fault(0, true);
  const std::size_t sent = counters(1'000).size();
  EXPECT_NEAR(static_cast<double>(sent), 750.0, 45.0);  // 3.3 standard deviations
  EXPECT_EQ(device_.fault_count(0), 1'000u);
  device_.set_fault(0, false);
  EXPECT_EQ(counters(100).size(), 100u);
  EXPECT_EQ(device_.fault_count(0), 1'000u);
  EXPECT_EQ(device_.fault_effects(0), 1'000u - sent);
}

TEST_F(FrameFaults, EffectsAreTheFramesThatWereChanged) {
  for (const char* const entry : {"stuck: last", "wrong: counter", "length: 4"})
    ASSERT_EQ(add("EgoStatus", entry), "");
  start();
  counters(1);
  device_.set_fault(0, true);
  counters(3);
  EXPECT_EQ(device_.fault_effects(0), 0u) << "all frames have the values of the one before";
  EXPECT_EQ(device_.fault_count(0), 3u);
  device_.set_fault(0, false);
  device_.set_fault(2, true);
  counters(3);
  EXPECT_EQ(device_.fault_effects(2), 3u);
  device_.set_fault(2, false);
  device_.set_fault(1, true);
  counters(3);
  EXPECT_EQ(device_.fault_effects(1), 3u);
}

TEST_F(FrameFaults, TwoThatCancelEachOtherHaveNoEffect) {
  ASSERT_EQ(add("EgoStatus", "flip_bits: [0]"), "");
  ASSERT_EQ(add("EgoStatus", "flip_bits: [0]"), "");
  ASSERT_EQ(add("EgoStatus", "repeat: 2"), "");
  start();
  device_.set_fault(0, true);
  device_.set_fault(1, true);
  counters(3);
  EXPECT_EQ(device_.fault_count(0), 3u);
  EXPECT_EQ(device_.fault_effects(0), 0u);
  EXPECT_EQ(device_.fault_effects(1), 0u);
  EXPECT_EQ(device_.fault_stopped_by(0), std::nullopt);
  device_.set_fault(1, false);
  device_.set_fault(2, true);
  counters(3);
  EXPECT_EQ(device_.fault_effects(0), 3u) << "copies of a frame count once";
  EXPECT_EQ(device_.fault_effects(2), 3u);
}

TEST_F(FrameFaults, DroppedFramesHaveNoOtherFault) {
  ASSERT_EQ(add("EgoStatus", "flip_bits: [0]"), "");
  ASSERT_EQ(add("EgoStatus", "delay: 5 ms"), "");
  ASSERT_EQ(add("EgoStatus", "drop: 100 %"), "");
  ASSERT_EQ(add("EgoStatus", "repeat: 1"), "");
  ASSERT_EQ(add("", "state: bus_off"), "");
  start();
  for (const std::size_t fault : {0, 1, 2, 3})
    device_.set_fault(fault, true);
  counters(3);
  EXPECT_EQ(device_.fault_effects(2), 2u) << "5 ms later";
  for (const std::size_t fault : {0, 1, 3}) {
    EXPECT_EQ(device_.fault_effects(fault), 0u) << fault;
    EXPECT_EQ(device_.fault_stopped_by(fault), 2u) << fault;
  }
  EXPECT_EQ(device_.fault_stopped_by(2), std::nullopt);
  device_.set_fault(2, false);
  counters(1);
  EXPECT_EQ(device_.fault_effects(0), 1u);
  EXPECT_EQ(device_.fault_stopped_by(0), std::nullopt) << "of some frames alone";
}

TEST_F(FrameFaults, DelayTakesEffectOnFramesThatTheEndOfTheRunDrops) {
  ASSERT_EQ(add("EgoStatus", "delay: 1000 ms"), "");
  start();
  device_.set_fault(0, true);
  counters(3);
  EXPECT_EQ(device_.fault_effects(0), 0u) << "they are not there yet";
  device_.enter_safe_state();
  tick();
  EXPECT_EQ(device_.fault_effects(0), 4u) << "those and the one of this tick";
}

TEST_F(FrameFaults, OfABusThatIsOffHaveNoEffect) {
  ASSERT_EQ(add("EgoStatus", "flip_bits: [0]"), "");
  ASSERT_EQ(add("", "state: bus_off"), "");
  start();
  device_.set_fault(0, true);
  device_.set_fault(1, true);
  counters(3);
  EXPECT_EQ(device_.fault_count(0), 0u);
  EXPECT_EQ(device_.fault_stopped_by(0), 1u);
}

TEST_F(FrameFaults, RepeatSendsEachFrameAgain) {
  ASSERT_EQ(add("EgoStatus", "repeat: 2"), "");
  start();
  device_.set_fault(0, true);
  EXPECT_EQ(counters(2), (std::vector<unsigned>{0, 0, 0, 1, 1, 1}));
}

TEST_F(FrameFaults, DelayedFramesGoOnAtTheirInstant) {
  ASSERT_EQ(add("EgoStatus", "delay: 25 ms"), "");
  start();
  device_.set_fault(0, true);
  EXPECT_EQ(counters(3), std::vector<unsigned>{}) << "at 0, 10 and 20 ms";
  device_.set_fault(0, false);
  EXPECT_EQ(counters(3), (std::vector<unsigned>{0, 3, 1, 4, 2, 5})) << "due at 25, 35 and 45 ms";
}

TEST_F(FrameFaults, CounterStandsStillWithARightChecksum) {
  ASSERT_EQ(add("EgoStatus", "wrong: counter"), "");
  start();
  EXPECT_EQ(counters(2), (std::vector<unsigned>{0, 1}));
  device_.set_fault(0, true);
  const std::vector<Frame> frames = tick();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].raw.data[4] & 15U, 1u);
  EXPECT_TRUE(has_right_checksum(frames[0]));
  EXPECT_EQ(counters(2), (std::vector<unsigned>{1, 1}));
  device_.set_fault(0, false);
  EXPECT_EQ(counters(2), (std::vector<unsigned>{5, 6}));
}

TEST_F(FrameFaults, FrozenFramesKeepTheirPayloadButNotTheirCounter) {
  ASSERT_EQ(add("EgoStatus", "stuck: last"), "");
  start();
  const Frame before = tick().at(0);
  device_.set_fault(0, true);
  value_ = 2.0;
  const Frame frozen = tick().at(0);
  EXPECT_EQ(frozen.raw.data[0], before.raw.data[0]);
  EXPECT_EQ(frozen.raw.data[4] & 15U, 1u) << "the counter goes on";
  EXPECT_TRUE(has_right_checksum(frozen));
  device_.set_fault(0, false);
  EXPECT_NE(tick().at(0).raw.data[0], before.raw.data[0]);
}

TEST_F(FrameFaults, ChecksumLengthAndBits) {
  ASSERT_EQ(add("EgoStatus", "wrong: checksum"), "");
  ASSERT_EQ(add("EgoStatus", "length: 3"), "");
  ASSERT_EQ(add("EgoStatus", "flip_bits: [0, 15]"), "");
  start();
  const Frame right = tick().at(0);
  EXPECT_TRUE(has_right_checksum(right));
  device_.set_fault(0, true);
  const Frame wrong = tick().at(0);
  EXPECT_FALSE(has_right_checksum(wrong));
  device_.set_fault(0, false);
  device_.set_fault(1, true);
  EXPECT_EQ(tick().at(0).raw.len, 3);
  device_.set_fault(1, false);
  device_.set_fault(2, true);
  const Frame flipped = tick().at(0);
  EXPECT_EQ(flipped.raw.data[0], right.raw.data[0] ^ 1);
  EXPECT_EQ(flipped.raw.data[1], right.raw.data[1] ^ 0x80);
  EXPECT_EQ(flipped.raw.data[2], right.raw.data[2]);
  EXPECT_FALSE(has_right_checksum(flipped));
}

TEST_F(FrameFaults, OfReceivedFramesChangeWhatTheRunReads) {
  ASSERT_EQ(add("BrakeCommand", "drop: 100 %"), "");
  ASSERT_EQ(add("BrakeCommand", "delay: 20 ms"), "");
  ASSERT_EQ(add("BrakeCommand", "wrong: checksum"), "");
  start();
  arrive(3.0);
  tick();
  EXPECT_EQ(deceleration().value, 3.0);
  device_.set_fault(0, true);
  arrive(4.0);
  tick();
  EXPECT_EQ(deceleration().value, 3.0) << "lost";
  EXPECT_EQ(device_.counters().rx, 2u) << "it was on the bus";
  device_.set_fault(0, false);
  tick();  // the frame lost before leaves a gap in the counter
  arrive(4.5);
  tick();
  device_.set_fault(1, true);
  arrive(5.0);
  tick();
  device_.set_fault(1, false);
  tick();
  EXPECT_NE(deceleration().value, 5.0) << "10 ms later";
  tick();
  EXPECT_EQ(deceleration().value, 5.0) << "20 ms later";
  EXPECT_EQ(deceleration().time_ns, 60 * ms);
  device_.set_fault(2, true);
  arrive(6.0);
  tick();
  EXPECT_EQ(deceleration().value, 5.0);
  EXPECT_EQ(device_.counters().bad_checksum, 1u);
}

TEST_F(FrameFaults, BusOffNeitherSendsNorReceives) {
  ASSERT_EQ(add("", "state: bus_off"), "");
  start();
  arrive(3.0);
  tick();
  EXPECT_TRUE(device_.connected());
  device_.set_fault(0, true);
  arrive(4.0);
  EXPECT_TRUE(tick().empty());
  EXPECT_FALSE(device_.connected());
  EXPECT_TRUE(deceleration().fresh);
  EXPECT_EQ(deceleration().value, 3.0) << "until its time-out";
  EXPECT_NE(device_.fault().find("bus-off by a fault of the scenario"), std::string::npos);
  device_.set_fault(0, false);
  arrive(5.0);
  EXPECT_EQ(tick().size(), 1u);
  EXPECT_TRUE(device_.connected());
  EXPECT_EQ(deceleration().value, 5.0);
  EXPECT_EQ(device_.fault(), "");
  EXPECT_EQ(device_.send_fault(), "");
}

TEST_F(FrameFaults, SafeValuesReachTheBusInEachFault) {
  ASSERT_EQ(add("EgoStatus", "drop: 100 %"), "");
  ASSERT_EQ(add("Object0", "delay: 10 ms"), "");
  ASSERT_EQ(add("", "state: bus_off"), "");
  start();
  for (std::size_t fault = 0; fault < 3; ++fault)
    device_.set_fault(fault, true);
  EXPECT_TRUE(tick().empty());
  device_.enter_safe_state();
  const std::vector<Frame> frames = tick();
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].raw.data[0], 0) << "speed 0, its safe value";
  EXPECT_EQ(bus_->sent.size(), 3u) << "one frame of each message";
  EXPECT_TRUE(device_.connected());
}

TEST_F(FrameFaults, FullQueueIsReportedAlsoOfAMessageWithFaults) {
  ASSERT_EQ(add("EgoStatus", "drop: 100 %"), "");
  start();
  bus_->full = true;
  for (int i = 0; i < 30; ++i)
    tick();
  EXPECT_GT(device_.counters().no_buffer, 30u);
  EXPECT_NE(device_.send_fault().find("took no frame for more than 250 ms"), std::string::npos)
      << device_.send_fault();
}

TEST_F(FrameFaults, FrameOfAMessageWithFaultsIsRetriedOnce) {
  ASSERT_EQ(add("EgoStatus", "wrong: counter"), "");
  start();
  bus_->full = true;
  EXPECT_TRUE(tick().empty());
  bus_->full = false;
  EXPECT_EQ(counters(2), (std::vector<unsigned>{0, 1})) << "no counter is skipped";
}

TEST_F(FrameFaults, ThatDoNotFitAreRefused) {
  const auto problem = [&](const std::string& message, const std::string& entry) {
    return tests::can_fault_problem(device_, message, entry);
  };
  EXPECT_EQ(problem("Nothing", "drop: 100 %"),
            "the bus neither sends nor receives this message; it sends or receives EgoStatus, Object0, "
            "ObjectHeader, BrakeCommand");
  EXPECT_EQ(problem("Object0", "wrong: counter"), "the scenario names no counter of this message");
  EXPECT_EQ(problem("Object0", "wrong: checksum"), "the scenario names no checksum of this message");
  EXPECT_EQ(problem("EgoStatus", "length: 12"), "no classic CAN frame has 12 bytes");
  EXPECT_EQ(problem("EgoStatus", "length: 8"), "all its frames already have a length of 8; give another");
  EXPECT_EQ(problem("EgoStatus", "flip_bits: [64]"),
            "bit 64 is not in its frames, which have the bits 0 to 63");
  EXPECT_NE(problem("EgoStatus", "delay: 61 s").find("from 1e-09 s to 60 s"), std::string::npos)
      << problem("EgoStatus", "delay: 61 s");
}

}  // namespace
}  // namespace hil::io::can
