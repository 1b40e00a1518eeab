// The virtual bus under the virtual clock: the same frames at the same instants in every run, in any order of
// the threads.

#include <gtest/gtest.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <random>
#include <string>
#include <thread>

#include "io/can/candump_log.hpp"
#include "io/virtual/hub.hpp"
#include "io/virtual/station.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::virtual_bus {
namespace {

/// A station in its own thread. Sends what `answer` returns for each frame. Waits a random time before each
/// receive, so that the threads run in many orders.
class AnsweringStation {
 public:
  using Answer = std::function<std::vector<can::Frame>(const can::Frame&)>;

  AnsweringStation(const std::string& address, const std::string& name, const Answer& answer,
                   std::uint64_t seed, int jitter_us = 200)
      : thread_([=, this] { run(address, name, answer, seed, jitter_us); }) {}
  ~AnsweringStation() {
    leave_ = true;
    thread_.join();
  }
  std::atomic<bool> leave_{false};
  /// Makes the station stop answering, and returns when it has stopped.
  void stop_answering() {
    hang_ = true;
    hangs_.wait(false);
  }

 private:
  std::atomic<bool> hang_{false};
  std::atomic<bool> hangs_{false};

  void run(const std::string& address, const std::string& name, const Answer& answer, std::uint64_t seed,
           int jitter_us) {
    const RunningClock clock;
    std::mt19937_64 random(seed);
    std::this_thread::sleep_for(
        std::chrono::microseconds(random() % 20000));  // stations connect in any order
    Station station(StationConfig{address, name});
    station.open(clock, Pacing::realtime);
    while (!leave_) {
      if (hang_) {
        hangs_ = true;
        hangs_.notify_all();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        continue;
      }
      if (jitter_us > 0)
        std::this_thread::sleep_for(std::chrono::microseconds(random() % static_cast<unsigned>(jitter_us)));
      can::Frame frame;
      switch (station.receive(frame)) {
        case can::ReceiveResult::frame:
          for (const can::Frame& reply : answer(frame))
            EXPECT_EQ(station.send(reply), can::SendResult::sent);
          break;
        case can::ReceiveResult::lost:
          return;
        case can::ReceiveResult::empty: {
          pollfd watched{station.fd(), POLLIN, 0};
          ::poll(&watched, 1, 5);
        }
      }
    }
  }
  std::thread thread_;
};

can::Frame frame_of_bytes(canid_t id, std::initializer_list<std::uint8_t> bytes) {
  return can::make_frame(id, std::span(bytes.begin(), bytes.size()));
}

/// All frames of a run, as a log of the hub.
std::string log_of_run(std::uint64_t jitter_seed, FaultConfig faults) {
  const SetClock clock;
  Hub hub(HubConfig{.name = "car", .path = {}, .faults = faults, .expected_stations = 3});
  hub.open(clock, Pacing::lockstep);
  // "b" answers frames of the hub twice; "a" answers those of "b", and "c" those of "a".
  const auto echo = [](canid_t from, canid_t to, int times) {
    return [=](const can::Frame& frame) {
      std::vector<can::Frame> replies;
      if (frame.identifier() != from) return replies;
      for (int count = 0; count < times; ++count) {
        const auto time = static_cast<std::uint8_t>(frame.time_ns / 1'000'000);
        replies.push_back(frame_of_bytes(to, {frame.raw.data[0], static_cast<std::uint8_t>(count), time}));
      }
      return replies;
    };
  };
  AnsweringStation b(hub.address(), "b", echo(0x100, 0x200, 2), jitter_seed);
  AnsweringStation a(hub.address(), "a", echo(0x200, 0x300, 1), jitter_seed + 1);
  AnsweringStation c(hub.address(), "c", echo(0x300, 0x400, 1), jitter_seed + 2);
  std::string log;
  for (int tick = 0; tick < 40; ++tick) {
    hub.send(frame_of_bytes(0x100, {static_cast<std::uint8_t>(tick)}));
    if (tick % 3 == 0) hub.send(frame_of_bytes(0x101, {}));
    const can::ExchangeResult result = hub.exchange(std::int64_t{tick} * 1'000'000);
    EXPECT_TRUE(result.completed()) << result.station << " " << hub.fault();
    can::Frame frame;
    while (hub.receive(frame) == can::ReceiveResult::frame) {
      can::append_candump_line(log, frame, frame.direction == can::Direction::tx ? "tx" : "rx");
      log += "\n";
    }
  }
  return log;
}

TEST(Lockstep, LogsOfTwoRunsAreIdentical) {
  const std::string first = log_of_run(1, {});
  EXPECT_EQ(log_of_run(1000, {}), first);
  EXPECT_EQ(log_of_run(7, {}), first);
  // The first step: the frames of the hub, then those of b, a and c.
  const std::string beginning =
      "(0000000000.000000) tx 100#00\n(0000000000.000000) tx 101#\n(0000000000.000000) rx 200#000000\n"
      "(0000000000.000000) rx 200#000100\n(0000000000.000000) rx 300#000000\n(0000000000.000000) rx "
      "300#000000\n"
      "(0000000000.000000) rx 400#000000\n(0000000000.000000) rx 400#000000\n(0000000000.001000) tx 100#01\n";
  EXPECT_EQ(first.substr(0, beginning.size()), beginning);
}

TEST(Lockstep, LogsWithInjectedFaultsAreIdentical) {
  const FaultConfig faults{.drop_probability = 0.1,
                           .corrupt_probability = 0.1,
                           .delay_probability = 0.2,
                           .delay_ns = 3'000'000,
                           .seed = 11};
  const std::string first = log_of_run(1, faults);
  EXPECT_EQ(log_of_run(500, faults), first);
  EXPECT_NE(first, log_of_run(1, {}));
}

TEST(Lockstep, FramesHaveTheRunTimeOfTheirStep) {
  const SetClock clock;
  Hub hub(HubConfig{.name = "car", .path = {}, .faults = {}, .expected_stations = 1});
  hub.open(clock, Pacing::lockstep);
  std::vector<RunTimeNs> times;
  {
    AnsweringStation listener(
        hub.address(), "x",
        [&](const can::Frame& frame) {
          times.push_back(frame.time_ns);
          return std::vector<can::Frame>{};
        },
        1);
    for (const RunTimeNs now : {5LL, 1'000'000LL, 2'000'000LL}) {
      hub.send(frame_of_bytes(1, {}));
      ASSERT_TRUE(hub.exchange(now).completed());
      EXPECT_EQ(times.back(), now) << "exchange returns after the station has answered";
    }
  }
  EXPECT_EQ(times.size(), 3U);
}

TEST(Lockstep, MoreFramesThanASocketHoldsAreAllDelivered) {
  const SetClock clock;
  Hub hub(HubConfig{.name = "car", .path = {}, .faults = {}, .expected_stations = 1});
  hub.open(clock, Pacing::lockstep);
  constexpr std::size_t count = 20000;
  std::atomic<std::size_t> received{0};
  AnsweringStation replying(
      hub.address(), "replying",
      [&](const can::Frame&) {
        ++received;
        return std::vector<can::Frame>{frame_of_bytes(2, {}), frame_of_bytes(3, {})};
      },
      1, 0);
  ASSERT_TRUE(hub.exchange(0).completed());
  for (std::size_t index = 0; index < count; ++index)
    hub.send(frame_of_bytes(1, {}));
  ASSERT_TRUE(hub.exchange(1).completed()) << hub.fault();
  EXPECT_EQ(received, count);
  std::size_t seen = 0;
  can::Frame frame;
  while (hub.receive(frame) == can::ReceiveResult::frame)
    ++seen;
  EXPECT_EQ(seen, 3 * count);
  EXPECT_EQ(hub.counters().dropped, 0U);
}

TEST(Lockstep, ReportsAStationThatDoesNotAnswer) {
  const SetClock clock;
  Hub hub(HubConfig{
      .name = "car", .path = {}, .faults = {}, .expected_stations = 1, .answer_limit_ns = 100'000'000});
  hub.open(clock, Pacing::lockstep);
  AnsweringStation silent(
      hub.address(), "silent", [](const can::Frame&) { return std::vector<can::Frame>{}; }, 1);
  ASSERT_TRUE(hub.exchange(0).completed());
  silent.stop_answering();
  const can::ExchangeResult result = hub.exchange(1);
  EXPECT_EQ(result.status, can::ExchangeResult::Status::station_timed_out);
  EXPECT_EQ(result.station, "silent");
  EXPECT_NE(hub.fault().find("'silent' did not answer within 100 ms"), std::string::npos);
  // Real time is the subject: the second exchange does not wait for the station.
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(hub.exchange(2).completed()) << "no second wait";
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(100));
}

TEST(Lockstep, ReportsAStationThatEnds) {
  const SetClock clock;
  Hub hub(HubConfig{.name = "car", .path = {}, .faults = {}, .expected_stations = 2});
  hub.open(clock, Pacing::lockstep);
  const auto silent = [](const can::Frame&) { return std::vector<can::Frame>{}; };
  AnsweringStation remaining(hub.address(), "remaining", silent, 1);
  auto ending = std::make_unique<AnsweringStation>(hub.address(), "ending", silent, 2);
  ASSERT_TRUE(hub.exchange(0).completed());
  ending.reset();
  const can::ExchangeResult result = hub.exchange(1);
  EXPECT_EQ(result.status, can::ExchangeResult::Status::station_ended);
  EXPECT_EQ(result.station, "ending");
}

TEST(Lockstep, ReportsMissingStations) {
  const SetClock clock;
  Hub hub(HubConfig{
      .name = "car", .path = {}, .faults = {}, .expected_stations = 2, .connect_limit_ns = 100'000'000});
  hub.open(clock, Pacing::lockstep);
  const AnsweringStation only(
      hub.address(), "only", [](const can::Frame&) { return std::vector<can::Frame>{}; }, 1);
  const can::ExchangeResult result = hub.exchange(0);
  EXPECT_EQ(result.status, can::ExchangeResult::Status::stations_missing);
  EXPECT_NE(hub.fault().find("1 of 2 expected stations"), std::string::npos) << hub.fault();
}

TEST(Lockstep, ReportsStationsThatAnswerEachOtherForever) {
  const SetClock clock;
  Hub hub(HubConfig{.name = "car", .path = {}, .faults = {}, .expected_stations = 2});
  hub.open(clock, Pacing::lockstep);
  const auto echo_back = [](const can::Frame& frame) { return std::vector<can::Frame>{frame}; };
  const AnsweringStation one(hub.address(), "one", echo_back, 1, 0);
  const AnsweringStation two(hub.address(), "two", echo_back, 2, 0);
  hub.send(frame_of_bytes(1, {}));
  EXPECT_EQ(hub.exchange(0).status, can::ExchangeResult::Status::too_many_rounds);
}

TEST(Lockstep, BusWithoutStationsCompletesItsExchange) {
  const SetClock clock;
  Hub hub(HubConfig{.name = "car", .path = {}, .faults = {}});
  hub.open(clock, Pacing::lockstep);
  hub.send(frame_of_bytes(1, {}));
  ASSERT_TRUE(hub.exchange(7).completed());
  can::Frame frame;
  ASSERT_EQ(hub.receive(frame), can::ReceiveResult::frame);
  EXPECT_EQ(frame.time_ns, 7);
  EXPECT_EQ(frame.direction, can::Direction::tx);
}

}  // namespace
}  // namespace hil::io::virtual_bus
