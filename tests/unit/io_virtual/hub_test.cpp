// The virtual bus in real time: hub and stations in one process.

#include "io/virtual/hub.hpp"

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "io/virtual/station.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::io::virtual_bus {
namespace {

can::Frame numbered(canid_t id, std::uint32_t number) {
  std::array<std::uint8_t, 4> bytes{};
  std::memcpy(bytes.data(), &number, sizeof number);
  return can::make_frame(id, bytes);
}

std::uint32_t number_of(const can::Frame& frame) {
  std::uint32_t number = 0;
  std::memcpy(&number, frame.raw.data, sizeof number);
  return number;
}

std::vector<can::Frame> receive_all(can::CanTransport& bus) {
  std::vector<can::Frame> frames;
  can::Frame frame;
  while (bus.receive(frame) == can::ReceiveResult::frame)
    frames.push_back(frame);
  return frames;
}

bool readable(int fd, int limit_ms) {
  pollfd watched{fd, POLLIN, 0};
  return ::poll(&watched, 1, limit_ms) == 1;
}

class HubTest : public ::testing::Test {
 protected:
  std::unique_ptr<Station> connect(const std::string& name) {
    auto station = std::make_unique<Station>(StationConfig{hub_.address(), name});
    station->open(clock_, Pacing::realtime);
    return station;
  }
  RunningClock clock_;
  Hub hub_{HubConfig{.name = "car", .path = {}, .faults = {}}};
};

TEST_F(HubTest, DeliversEveryFrameToEveryOtherStationInOneOrder) {
  hub_.open(clock_, Pacing::realtime);
  auto one = connect("one");
  auto two = connect("two");
  EXPECT_TRUE(receive_all(hub_).empty());
  EXPECT_EQ(hub_.station_count(), 2U);

  EXPECT_EQ(one->send(numbered(0x10, 1)), can::SendResult::sent);
  EXPECT_EQ(two->send(numbered(0x20, 2)), can::SendResult::sent);
  auto seen = receive_all(hub_);
  EXPECT_EQ(hub_.send(numbered(0x30, 3)), can::SendResult::sent);
  EXPECT_EQ(one->send(numbered(0x10, 4)), can::SendResult::sent);
  for (const can::Frame& frame : receive_all(hub_))
    seen.push_back(frame);
  ASSERT_EQ(seen.size(), 4U);

  const auto at_one = receive_all(*one);
  const auto at_two = receive_all(*two);
  ASSERT_EQ(at_one.size(), 2U);  // the frames of the other stations
  ASSERT_EQ(at_two.size(), 3U);
  std::size_t next_one = 0;
  std::size_t next_two = 0;
  RunTimeNs last_ns = 0;
  for (const can::Frame& frame : seen) {
    EXPECT_EQ(frame.direction, frame.raw.can_id == 0x30 ? can::Direction::tx : can::Direction::rx);
    EXPECT_GE(frame.time_ns, last_ns);
    last_ns = frame.time_ns;
    if (frame.raw.can_id != 0x10) {
      EXPECT_TRUE(at_one[next_one++].same_content(frame));
    }
    if (frame.raw.can_id != 0x20) {
      EXPECT_TRUE(at_two[next_two++].same_content(frame));
    }
  }
}

TEST_F(HubTest, FdAndExtendedFramesKeepTheirContent) {
  hub_.open(clock_, Pacing::realtime);
  auto station = connect("one");
  std::array<std::uint8_t, 64> bytes{};
  for (std::size_t index = 0; index < bytes.size(); ++index)
    bytes[index] = static_cast<std::uint8_t>(index * 3);
  can::Frame sent = can::make_frame(0x1ABCDEF | CAN_EFF_FLAG, bytes, true);
  sent.raw.flags = CANFD_BRS;
  station->send(sent);
  const auto seen = receive_all(hub_);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_TRUE(seen[0].same_content(sent));
  hub_.send(sent);
  const auto back = receive_all(*station);
  ASSERT_EQ(back.size(), 1U);
  EXPECT_TRUE(back[0].same_content(sent));
}

TEST_F(HubTest, SlowClientLosesFramesWithoutBlockingOthers) {
  hub_.open(clock_, Pacing::realtime);
  auto slow = connect("slow");
  auto good = connect("good");
  receive_all(hub_);
  constexpr std::uint32_t count = 20000;
  std::uint32_t seen_by_good = 0;
  for (std::uint32_t number = 0; number < count; ++number) {
    ASSERT_EQ(hub_.send(numbered(1, number)), can::SendResult::sent);
    seen_by_good += static_cast<std::uint32_t>(receive_all(*good).size());
    receive_all(hub_);
  }
  EXPECT_EQ(seen_by_good, count);
  const auto counters = hub_.station_counters();
  ASSERT_EQ(counters.size(), 2U);
  EXPECT_EQ(counters[0].name, "slow");
  EXPECT_GT(counters[0].dropped, 0U);
  EXPECT_EQ(counters[0].delivered + counters[0].dropped, count);
  EXPECT_EQ(counters[1].dropped, 0U);
  EXPECT_EQ(hub_.counters().dropped, counters[0].dropped);
  // It received the first frames without gaps.
  const auto got = receive_all(*slow);
  ASSERT_EQ(got.size(), counters[0].delivered);
  for (std::uint32_t number = 0; number < got.size(); ++number)
    ASSERT_EQ(number_of(got[number]), number);
}

TEST_F(HubTest, InvalidPacketsAreCountedAndIgnored) {
  hub_.open(clock_, Pacing::realtime);
  sockaddr_un place{};
  place.sun_family = AF_UNIX;
  const std::string path = hub_.address().substr(5);
  std::memcpy(place.sun_path, path.c_str(), path.size() + 1);
  const int raw = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::connect(raw, reinterpret_cast<sockaddr*>(&place), sizeof place), 0);
  std::array<std::uint8_t, 300> noise{};
  noise.fill(0xEE);
  std::uint64_t sent = 0;
  for (std::size_t size = 1; size <= noise.size(); ++size) {
    ASSERT_EQ(::send(raw, noise.data(), size, 0), static_cast<ssize_t>(size));
    ++sent;
    receive_all(hub_);
  }
  EXPECT_EQ(hub_.counters().malformed, sent);
  const can::Frame frame = numbered(5, 6);
  ASSERT_EQ(::send(raw, &frame.raw, CAN_MTU, 0), static_cast<ssize_t>(CAN_MTU));
  const auto seen = receive_all(hub_);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_TRUE(seen[0].same_content(frame));
  ::close(raw);
  receive_all(hub_);
  EXPECT_EQ(hub_.station_count(), 0U);
}

TEST_F(HubTest, DescriptorBecomesReadableWithWork) {
  hub_.open(clock_, Pacing::realtime);
  EXPECT_FALSE(readable(hub_.fd(), 0));
  auto station = connect("one");
  EXPECT_TRUE(readable(hub_.fd(), 1000)) << "a new station";
  receive_all(hub_);
  EXPECT_FALSE(readable(hub_.fd(), 0));
  station->send(numbered(1, 1));
  EXPECT_TRUE(readable(hub_.fd(), 1000));
  EXPECT_EQ(receive_all(hub_).size(), 1U);
  station.reset();
  EXPECT_TRUE(readable(hub_.fd(), 1000)) << "a station that left";
  receive_all(hub_);
  EXPECT_EQ(hub_.station_count(), 0U);
  EXPECT_FALSE(hub_.station_counters().at(0).connected);
}

TEST_F(HubTest, ForgetsTheOldestClosedConnections) {
  hub_.open(clock_, Pacing::realtime);
  const auto stays = connect("stays");
  receive_all(hub_);
  for (std::uint64_t connection = 2; connection <= 201; ++connection) {
    connect("closes");
    while (hub_.station_counters().back().connection != connection ||
           hub_.station_counters().back().connected)
      receive_all(hub_);
  }
  const auto counters = hub_.station_counters();
  ASSERT_EQ(counters.size(), 65U);
  EXPECT_EQ(counters.front().name, "stays");
  EXPECT_TRUE(counters.front().connected);
  EXPECT_EQ(counters.back().connection, 201U);
  EXPECT_EQ(counters[1].connection, 138U);
}

TEST_F(HubTest, FiltersApplyToTheStationThatSetThem) {
  hub_.open(clock_, Pacing::realtime);
  auto station = connect("one");
  const can_filter only{0x20, 0x7FF};
  station->set_filters(std::span(&only, 1));
  receive_all(hub_);
  hub_.send(numbered(0x10, 1));
  hub_.send(numbered(0x20, 2));
  EXPECT_EQ(receive_all(hub_).size(), 2U);
  const auto seen = receive_all(*station);
  ASSERT_EQ(seen.size(), 1U);
  EXPECT_EQ(number_of(seen[0]), 2U);
}

TEST_F(HubTest, ClientWaitsUntilTheHubOpens) {
  std::unique_ptr<Station> station;
  std::atomic<bool> begins{false};
  std::thread early([&] {
    begins = true;
    station = connect("early");
  });
  EXPECT_TRUE(tests::eventually([&] { return begins.load(); }));
  hub_.open(clock_, Pacing::realtime);
  early.join();
  receive_all(hub_);
  EXPECT_EQ(hub_.station_count(), 1U);
}

TEST_F(HubTest, ClosedHubIsLostForItsClients) {
  hub_.open(clock_, Pacing::realtime);
  auto station = connect("one");
  receive_all(hub_);
  hub_.close();
  can::Frame frame;
  EXPECT_EQ(station->receive(frame), can::ReceiveResult::lost);
  EXPECT_NE(station->fault().find("closed"), std::string::npos);
  EXPECT_EQ(station->send(numbered(1, 1)), can::SendResult::error);
}

TEST(HubOpening, ReportsPathsThatCanNotBeUsed) {
  const RunningClock clock;
  Hub too_long(HubConfig{.name = "a", .path = "/tmp/" + std::string(120, 'x'), .faults = {}});
  EXPECT_THROW(too_long.open(clock, Pacing::realtime), DeviceError);
  Hub nowhere(HubConfig{.name = "a", .path = "/nowhere/at/all", .faults = {}});
  EXPECT_THROW(nowhere.open(clock, Pacing::realtime), DeviceError);

  Hub first(HubConfig{.name = "a", .path = {}, .faults = {}});
  first.open(clock, Pacing::realtime);
  Hub second(HubConfig{.name = "a", .path = first.address().substr(5), .faults = {}});
  try {
    second.open(clock, Pacing::realtime);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("another program listens"), std::string::npos);
  }
  Station unused(StationConfig{"unix:/nowhere/at/all", "x", 10'000'000});
  EXPECT_THROW(unused.open(clock, Pacing::realtime), DeviceError);
  Station wrong(StationConfig{"tcp:somewhere", "x", 10'000'000});
  EXPECT_THROW(wrong.open(clock, Pacing::realtime), DeviceError);
}

TEST(HubOpening, ReplacesStaleSocketsButNoOtherFiles) {
  const RunningClock clock;
  const tests::TemporaryFolder folder;
  const std::string stale = (folder / "stale").string();
  sockaddr_un place{};
  place.sun_family = AF_UNIX;
  std::memcpy(place.sun_path, stale.c_str(), stale.size() + 1);
  const int dead = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  ASSERT_EQ(::bind(dead, reinterpret_cast<sockaddr*>(&place), sizeof place), 0);
  ::close(dead);
  Hub hub(HubConfig{.name = "a", .path = stale, .faults = {}});
  EXPECT_NO_THROW(hub.open(clock, Pacing::realtime));
  hub.close();
  EXPECT_FALSE(std::filesystem::exists(stale));

  const std::string file = (folder / "file").string();
  std::ofstream(file) << "content";
  Hub refused(HubConfig{.name = "a", .path = file, .faults = {}});
  EXPECT_THROW(refused.open(clock, Pacing::realtime), DeviceError);
  EXPECT_TRUE(std::filesystem::exists(file));
}

TEST(HubFaults, HubInjectsTheConfiguredFaults) {
  const RunningClock clock;
  const FaultConfig faults{.drop_probability = 0.2,
                           .corrupt_probability = 0.2,
                           .delay_probability = 0.2,
                           .delay_ns = 2'000'000,
                           .seed = 42};
  Hub hub(HubConfig{.name = "car", .path = {}, .faults = faults});
  hub.open(clock, Pacing::realtime);
  Station station(StationConfig{hub.address(), "one"});
  station.open(clock, Pacing::realtime);
  receive_all(hub);
  std::size_t seen = 0;
  std::size_t changed = 0;
  for (std::uint32_t number = 0; number < 500; ++number) {
    hub.send(numbered(1, number));
    for (const can::Frame& frame : receive_all(station)) {
      ++seen;
      changed += number_of(frame) != number ? 1 : 0;
    }
  }
  const can::InjectedFaults so_far = hub.counters().injected;
  EXPECT_EQ(seen + so_far.dropped_tx + so_far.delayed, 500U);
  EXPECT_EQ(so_far.dropped_rx, 0U);
  EXPECT_GT(changed, 0U);
  EXPECT_GT(so_far.delayed, 0U);
  std::size_t late = 0;
  while (late < so_far.delayed && readable(hub.fd(), 1000)) {  // the hub's timer
    receive_all(hub);
    late += receive_all(station).size();
  }
  EXPECT_EQ(late, so_far.delayed);
}

}  // namespace
}  // namespace hil::io::virtual_bus
