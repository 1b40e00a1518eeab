#include "io/modbus/server_device.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "peers.hpp"
#include "registers.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::modbus {
namespace {

using std::chrono::milliseconds;
using test::Bytes;
using test::entry;
using test::frame;
using test::latched;
using test::RawClient;
using tests::eventually;

/// hil writes speed and lamp, clients write request and level.
RegisterMap served_map() {
  RegisterMap map{{entry("speed", Table::input, 0, ValueType::u32, true),
                   entry("lamp", Table::discrete_input, 0, ValueType::boolean, true),
                   entry("status", Table::holding, 0, ValueType::u16, true),
                   entry("request", Table::holding, 1, ValueType::i16, false),
                   entry("level", Table::holding, 2, ValueType::f32, false),
                   entry("start", Table::coil, 0, ValueType::boolean, false)}};
  map.entries[0].safe_value = 3.0;
  map.entries[3].safe_value = -7.0;
  map.entries[3].scale = 0.5;
  return map;
}

/// Zero where the reply is shorter.
std::uint32_t word32(const Bytes& reply, std::size_t at) {
  if (reply.size() < at + 4) return 0;
  return static_cast<std::uint32_t>(reply[at]) << 24U | static_cast<std::uint32_t>(reply[at + 1]) << 16U |
         static_cast<std::uint32_t>(reply[at + 2]) << 8U | reply[at + 3];
}

struct Served {
  explicit Served(ServerSettings settings = {.name = "panel"}, Pacing pacing = Pacing::realtime)
      : device(std::move(settings), served_map()) {
    device.start(clock, pacing);
  }
  RunningClock clock;
  ServerDevice device;
};

TEST(ServerDevice, RegistersStartAtTheirSafeValues) {
  Served served;
  EXPECT_EQ(latched(served.device)[0].value, -7.0);
  EXPECT_FALSE(latched(served.device)[0].fresh);
  RawClient client(served.device.port());
  client.send(frame(9, {4, 0, 0, 0, 2}));
  EXPECT_EQ(client.receive_frame(), frame(9, {4, 4, 0, 0, 0, 3}));
  client.send(frame(10, {3, 0, 1, 0, 1}));
  EXPECT_EQ(client.receive_frame(), frame(10, {3, 2, 0xFF, 0xF2}));  // -7 / 0.5 = -14
}

TEST(ServerDevice, WritesArriveWithTheirTime) {
  Served served;
  RawClient client(served.device.port());
  const RunTimeNs before = served.clock.now_ns();
  client.send(frame(1, {6, 0, 1, 0, 8}));
  EXPECT_EQ(client.receive_frame(), frame(1, {6, 0, 1, 0, 8}));
  const std::vector<Sample> samples = latched(served.device);
  EXPECT_EQ(samples[0].value, 4.0);
  EXPECT_TRUE(samples[0].fresh);
  EXPECT_GE(samples[0].time_ns, before);
  EXPECT_LE(samples[0].time_ns, served.clock.now_ns());
  EXPECT_FALSE(samples[1].fresh) << "level was not written";
  client.send(frame(2, {15, 0, 0, 0, 1, 1, 1}));
  EXPECT_EQ(client.receive_frame(), frame(2, {15, 0, 0, 0, 1}));
  EXPECT_EQ(latched(served.device)[2].value, 1.0);
}

TEST(ServerDevice, RefusesNanAndKeepsTheLastValue) {
  Served served;
  RawClient client(served.device.port());
  client.send(frame(1, {16, 0, 2, 0, 2, 4, 0x40, 0x20, 0, 0}));  // 2.5
  client.receive_frame();
  client.send(frame(2, {16, 0, 2, 0, 2, 4, 0x7F, 0xC0, 0, 0}));  // NaN
  EXPECT_EQ(client.receive_frame(), frame(2, {0x90, 3}));
  EXPECT_EQ(latched(served.device)[1].value, 2.5);
  EXPECT_EQ(served.device.counters().by_code[3], 1U);
  const std::optional<RequestRange> first = served.device.counters().first_refused[3];
  ASSERT_TRUE(first);
  EXPECT_EQ(text_of(*first, served.device.map()),
            "writing " + served.device.inputs()[1].name + " (holding 2..3)");
}

TEST(ServerDevice, RefusesWritesToRegistersOfHil) {
  Served served;
  RawClient client(served.device.port());
  client.send(frame(1, {6, 0, 0, 0, 8}));
  EXPECT_EQ(client.receive_frame(), frame(1, {0x86, 2}));
  client.send(frame(2, {16, 0, 0, 0, 2, 4, 0, 1, 0, 1}));  // status and request
  EXPECT_EQ(client.receive_frame(), frame(2, {0x90, 2}));
  EXPECT_FALSE(latched(served.device)[0].fresh);
}

TEST(ServerDevice, ValuesOfTwoRegistersAreNeverTorn) {
  Served served;
  std::atomic<bool> stop{false};
  std::thread tick([&] {
    for (std::uint32_t i = 0; !stop.load(); ++i) {
      const std::uint32_t half = i & 0xFFFFU;
      served.device.release_outputs(std::vector<double>{static_cast<double>(half << 16U | half), 0, 0}, 0);
    }
  });
  RawClient client(served.device.port());
  std::uint32_t last = 0;
  int changes = 0;
  EXPECT_TRUE(eventually([&] {
    client.send(frame(1, {4, 0, 0, 0, 2}));
    const std::uint32_t value = word32(client.receive_frame(), 9);
    EXPECT_TRUE(value == 3 || value >> 16U == (value & 0xFFFFU)) << value;
    changes += value != last ? 1 : 0;
    last = value;
    return changes > 500;
  }));
  stop.store(true);
  tick.join();
}

TEST(ServerDevice, NextReleaseReplacesTheSafeState) {
  Served served;
  RawClient client(served.device.port());
  const auto speed = [&] {
    client.send(frame(1, {4, 0, 0, 0, 2}));
    return word32(client.receive_frame(), 9);
  };
  served.device.release_outputs(std::vector<double>{1000, 1, 5}, 0);
  EXPECT_EQ(speed(), 1000U);
  served.device.enter_safe_state();
  EXPECT_TRUE(eventually([&] { return speed() == 3; }));
  served.device.release_outputs(std::vector<double>{1001, 1, 5}, 0);
  EXPECT_EQ(speed(), 1001U);
}

TEST(ServerDevice, LockstepAnswersOnlyInExchange) {
  SetClock clock;
  ServerDevice device({.name = "panel"}, served_map());
  device.start(clock, Pacing::lockstep);
  RawClient client(device.port());
  client.send(frame(1, {6, 0, 1, 0, 8}));
  EXPECT_TRUE(client.receive_frame(milliseconds(50)).empty());
  EXPECT_FALSE(latched(device)[0].fresh);
  ASSERT_TRUE(eventually([&] {
    EXPECT_TRUE(device.exchange(70));
    return latched(device)[0].fresh;
  }));
  EXPECT_EQ(latched(device)[0].time_ns, 70);
  EXPECT_EQ(client.receive_frame(), frame(1, {6, 0, 1, 0, 8}));
  device.stop();
}

TEST(ServerDevice, InputsAgeOnlyWithMaxAge) {
  Served lasting({.name = "panel", .max_age = milliseconds(0)});
  Served ageing({.name = "panel", .max_age = milliseconds(30)});
  for (Served* const served : {&lasting, &ageing}) {
    RawClient client(served->device.port());
    client.send(frame(1, {6, 0, 1, 0, 8}));
    client.receive_frame();
    EXPECT_EQ(latched(served->device)[0].value, 4.0);
  }
  EXPECT_TRUE(eventually([&] { return !latched(ageing.device)[0].fresh; }));
  EXPECT_EQ(latched(ageing.device)[0].value, -7.0);
  EXPECT_TRUE(latched(lasting.device)[0].fresh);
  EXPECT_EQ(latched(lasting.device)[0].value, 4.0);
}

/// Shows 61 minutes before the run until begin_run(), and then the begin of the run.
class StartingClock final : public RunClock {
 public:
  RunTimeNs now_ns() const noexcept override { return begun_.load() ? 0 : -hour_ns - minute_ns; }
  RunTimeNs to_run_time(RunTimeNs stamp_ns) const noexcept override {
    return begun_.load() && stamp_ns < -hour_ns ? stamp_ns + hour_ns : stamp_ns;
  }
  void begin_run() noexcept { begun_.store(true); }
  static constexpr RunTimeNs minute_ns = 60'000'000'000;

 private:
  static constexpr RunTimeNs hour_ns = 60 * minute_ns;
  std::atomic<bool> begun_{false};
};

TEST(ServerDevice, ValuesWrittenBeforeTheRunKeepTheirAge) {
  for (const std::chrono::seconds max_age : {std::chrono::seconds(59), std::chrono::seconds(61)}) {
    StartingClock clock;
    ServerDevice device({.name = "panel", .max_age = max_age}, served_map());
    device.start(clock, Pacing::realtime);
    RawClient client(device.port());
    client.send(frame(1, {6, 0, 1, 0, 8}));
    client.receive_frame();
    EXPECT_TRUE(latched(device)[0].fresh);
    clock.begin_run();
    EXPECT_EQ(latched(device)[0].fresh, max_age.count() == 61);
    EXPECT_EQ(latched(device)[0].time_ns, -StartingClock::minute_ns);
    device.stop();
  }
}

TEST(ServerDevice, ReportsAPortInUse) {
  Served first;
  ServerDevice second({.name = "other", .endpoint = {"127.0.0.1", first.device.port()}}, served_map());
  try {
    second.start(first.clock, Pacing::realtime);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_EQ(std::string(error.what()),
              "Modbus server other can not listen on 127.0.0.1:" + std::to_string(first.device.port()) +
                  ": Address already in use; another program uses that port: stop it, or choose "
                  "another port (auto in a scenario: a free one)");
  }
  EXPECT_EQ(second.port(), 0);
  second.stop();
}

TEST(ServerDevice, ReportsAForeignAddress) {
  RunningClock clock;
  ServerDevice device({.name = "far", .endpoint = {"192.0.2.1", 0}}, served_map());
  try {
    device.start(clock, Pacing::realtime);
    FAIL();
  } catch (const DeviceError& error) {
    EXPECT_NE(
        std::string(error.what()).find("no network interface of this machine has the address 192.0.2.1"),
        std::string::npos)
        << error.what();
  }
}

TEST(ServerDevice, StartsAgainAfterStop) {
  RunningClock clock;
  ServerDevice device({.name = "panel"}, served_map());
  for (int round = 0; round < 20; ++round) {
    device.start(clock, Pacing::realtime);
    RawClient client(device.port());
    client.send(frame(1, {17}));
    EXPECT_FALSE(client.receive_frame().empty());
    EXPECT_TRUE(device.connected());
    device.stop();
    EXPECT_TRUE(client.closed_within(milliseconds(1000)));
    device.stop();
  }
}

}  // namespace
}  // namespace hil::io::modbus
