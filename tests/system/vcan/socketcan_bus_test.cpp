// SocketCanBus on a real vcan0.

#include "io/can/socketcan_bus.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include <algorithm>
#include <array>
#include <cstring>

#include "real_bus.hpp"

namespace hil::io::can {
namespace {

using tests::eventually;

Frame numbered(canid_t id, std::uint32_t number) {
  std::array<std::uint8_t, 8> bytes{};
  std::memcpy(bytes.data(), &number, sizeof number);
  return make_frame(id, bytes);
}

std::uint32_t number_of(const Frame& frame) {
  std::uint32_t number = 0;
  std::memcpy(&number, frame.raw.data, sizeof number);
  return number;
}

class RealVcan : public ::testing::Test {
 protected:
  void SetUp() override {
    one_.open(clock_, Pacing::realtime);
    two_.open(clock_, Pacing::realtime);
  }
  const RunningClock clock_;
  SocketCanBus one_{{"vcan0"}};
  SocketCanBus two_{{"vcan0"}};
};

TEST_F(RealVcan, FramesHaveTheirDirectionAndOneOrder) {
  for (std::uint32_t number = 0; number < 100; ++number) {
    ASSERT_EQ((number % 3 == 0 ? one_ : two_).send(numbered(0x100 + number % 3, number)), SendResult::sent);
  }
  const auto at_one = receive_count(one_, 100);
  const auto at_two = receive_count(two_, 100);
  ASSERT_EQ(at_one.size(), 100U);
  ASSERT_EQ(at_two.size(), 100U);
  for (std::uint32_t number = 0; number < 100; ++number) {
    EXPECT_EQ(number_of(at_one[number]), number);
    EXPECT_TRUE(at_one[number].same_content(at_two[number]));
    EXPECT_EQ(at_one[number].direction, number % 3 == 0 ? Direction::tx : Direction::rx);
    EXPECT_EQ(at_two[number].direction, number % 3 == 0 ? Direction::rx : Direction::tx);
    EXPECT_EQ(at_one[number].wall_ns, at_two[number].wall_ns) << "the kernel's timestamp";
  }
}

TEST_F(RealVcan, TimestampsAreThoseOfTheKernel) {
  const RunTimeNs before = clock_.now_ns();
  two_.send(numbered(1, 1));
  const RunTimeNs after = clock_.now_ns();
  constexpr RunTimeNs wait_ns = 200'000'000;
  std::this_thread::sleep_for(std::chrono::nanoseconds(wait_ns));  // the frame waits in the socket
  const auto frames = receive_all(one_);
  ASSERT_EQ(frames.size(), 1U);
  constexpr RunTimeNs clock_slack_ns = 1'000'000;  // between the monotonic and the wall clock
  EXPECT_GE(frames[0].time_ns, before - clock_slack_ns);
  EXPECT_LT(frames[0].time_ns, after + wait_ns / 2) << "the time of the arrival";
  const auto wall_now = std::chrono::nanoseconds(std::chrono::system_clock::now().time_since_epoch()).count();
  EXPECT_GE(wall_now - frames[0].wall_ns, wait_ns / 2);
  EXPECT_LT(wall_now - frames[0].wall_ns, 10'000'000'000);
}

TEST_F(RealVcan, ExtendedRemoteAndErrorFramesKeepTheirKind) {
  two_.send(make_frame(0x1234567 | CAN_EFF_FLAG, {}));
  two_.send(make_frame(0x77 | CAN_RTR_FLAG, {}));
  const std::array<std::uint8_t, 8> details{};
  two_.send(make_frame(CAN_ERR_FLAG | CAN_ERR_BUSOFF, details));
  const auto frames = receive_count(one_, 3);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_TRUE(frames[0].is_extended());
  EXPECT_EQ(frames[0].identifier(), 0x1234567U);
  EXPECT_TRUE(frames[1].is_remote());
  EXPECT_TRUE(frames[2].is_error());
}

TEST_F(RealVcan, FiltersAreSetInTheKernel) {
  const can_filter only{0x20, 0x7F0};
  one_.set_filters(std::span(&only, 1));
  for (std::uint32_t number = 0; number < 0x40; ++number)
    two_.send(numbered(number, number));
  EXPECT_EQ(receive_count(two_, 0x40).size(), 0x40U);
  EXPECT_EQ(receive_count(one_, 16).size(), 16U);
  one_.set_filters({});
  two_.send(numbered(0x555, 0));
  EXPECT_EQ(receive_count(one_, 1).size(), 1U);
}

TEST_F(RealVcan, FdFramesNeedAnInterfaceWithFdMtu) {
  std::array<std::uint8_t, 64> bytes{};
  for (std::size_t index = 0; index < bytes.size(); ++index)
    bytes[index] = static_cast<std::uint8_t>(index);
  Frame frame = make_frame(0x123, bytes, true);
  frame.raw.flags = CANFD_BRS;
  shell("ip link set vcan0 down && ip link set vcan0 mtu 16 && ip link set vcan0 up");
  ASSERT_TRUE(eventually(
      [&] { return receive_all(two_).empty() && two_.fd() >= 0 && two_.counters().reopened == 1; }));
  EXPECT_EQ(two_.send(frame), SendResult::error) << "a classic bus";
  shell("ip link set vcan0 down && ip link set vcan0 mtu 72 && ip link set vcan0 up");
  ASSERT_TRUE(eventually(
      [&] { return receive_all(two_).empty() && two_.fd() >= 0 && two_.counters().reopened == 2; }));
  ASSERT_TRUE(
      eventually([&] { return receive_all(one_).empty() && one_.fd() >= 0 && one_.fault().empty(); }));
  ASSERT_EQ(two_.send(frame), SendResult::sent);
  const auto frames = receive_count(one_, 1);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_TRUE(frames[0].is_fd);
  EXPECT_NE(frames[0].raw.flags & CANFD_BRS, 0);
  EXPECT_TRUE(std::ranges::equal(frames[0].payload(), bytes));
}

TEST_F(RealVcan, ReopensAnInterfaceThatWasDeleted) {
  two_.send(numbered(1, 41));
  ASSERT_EQ(receive_count(two_, 1).size(), 1U);  // after the bus
  shell("ip link del vcan0");
  const auto last = receive_all(one_);
  ASSERT_EQ(last.size(), 1U) << "the frame before the deletion";
  EXPECT_EQ(number_of(last[0]), 41U);
  Frame frame;
  EXPECT_EQ(one_.receive(frame), ReceiveResult::lost);
  EXPECT_NE(one_.fault().find("'vcan0' is lost"), std::string::npos) << one_.fault();
  EXPECT_EQ(one_.send(numbered(1, 1)), SendResult::error);
  EXPECT_FALSE(
      eventually([&] { return one_.receive(frame) != ReceiveResult::lost; }, std::chrono::milliseconds(100)));
  shell("ip link add dev vcan0 type vcan");
  EXPECT_FALSE(
      eventually([&] { return one_.receive(frame) != ReceiveResult::lost; }, std::chrono::milliseconds(100)))
      << "down";
  shell("ip link set vcan0 up");
  EXPECT_TRUE(eventually([&] { return one_.receive(frame) == ReceiveResult::empty; }));
  EXPECT_EQ(one_.fault(), "");
  EXPECT_EQ(one_.counters().reopened, 1U);
  EXPECT_TRUE(eventually([&] { return two_.receive(frame) == ReceiveResult::empty; }));
  two_.send(numbered(1, 42));
  const auto frames = receive_count(one_, 1);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(number_of(frames[0]), 42U);
}

TEST_F(RealVcan, CountsEveryLostFrame) {
  SocketCanBus slow({.interface = "vcan0", .receive_buffer_bytes = 20000});
  slow.open(clock_, Pacing::realtime);
  constexpr std::uint32_t count = 20000;
  std::uint32_t next = 0;
  std::uint64_t gaps = 0;
  std::uint32_t received = 0;
  const auto read_on = [&] {
    for (const Frame& frame : receive_all(slow)) {
      gaps += number_of(frame) - next;
      next = number_of(frame) + 1;
      ++received;
    }
  };
  for (std::uint32_t number = 0; number < count; ++number) {
    ASSERT_EQ(two_.send(numbered(0x10, number)), SendResult::sent);
    ASSERT_EQ(receive_count(two_, 1).size(), 1U);  // after the bus
    if (number % 700 == 699) read_on();
  }
  read_on();
  two_.send(numbered(0x10, count));  // the kernel reports its count with the next frame
  ASSERT_EQ(receive_count(two_, 1).size(), 1U);
  read_on();
  EXPECT_GT(gaps, 1000U);
  EXPECT_EQ(received + gaps, count + 1);
  EXPECT_EQ(slow.counters().dropped, gaps);
}

TEST_F(RealVcan, ReportsAFullQueue) {
  shell("tc qdisc add dev vcan0 root netem delay 200ms limit 5");
  int sent = 0;
  int refused = 0;
  for (std::uint32_t number = 0; number < 50; ++number) {
    const SendResult result = two_.send(numbered(2, number));
    sent += result == SendResult::sent ? 1 : 0;
    refused += result == SendResult::no_buffer ? 1 : 0;
  }
  EXPECT_EQ(sent, 5);
  EXPECT_EQ(refused, 45);
  std::size_t arrived = 0;
  EXPECT_TRUE(eventually([&] {
    arrived += receive_all(one_).size();
    return arrived == 5;
  }));
  EXPECT_TRUE(eventually([&] { return two_.send(numbered(2, 99)) == SendResult::sent; }));
  shell("tc qdisc del dev vcan0 root");
}

TEST(RealVcanOpening, ReportsWhyItCanNotOpen) {
  const RunningClock clock;
  const auto refusal_of = [&](const char* interface, Pacing pacing) -> std::string {
    SocketCanBus bus({interface});
    try {
      bus.open(clock, pacing);
    } catch (const DeviceError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(refusal_of("vcan7", Pacing::realtime).find("'vcan7' does not exist"), std::string::npos);
  EXPECT_NE(refusal_of("vcan7", Pacing::realtime).find("ip link add dev vcan7 type vcan"), std::string::npos);
  shell("ip link add dev vcan7 type vcan");
  EXPECT_NE(refusal_of("vcan7", Pacing::realtime).find("is down; bring it up with"), std::string::npos);
  shell("ip link del vcan7");
  EXPECT_NE(refusal_of("lo", Pacing::realtime).find("is it a CAN interface?"), std::string::npos)
      << refusal_of("lo", Pacing::realtime);
  EXPECT_NE(refusal_of("vcan0", Pacing::lockstep).find("can not follow a virtual clock"), std::string::npos);
  EXPECT_NE(refusal_of("a-name-that-is-too-long", Pacing::realtime).find("1 to 15 characters"),
            std::string::npos);
}

}  // namespace
}  // namespace hil::io::can
