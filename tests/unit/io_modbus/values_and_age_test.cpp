// Values that do not fit their register, and values older than max_age: counted, with one event per episode.
#include <gtest/gtest.h>

#include <cmath>

#include "client_exchange.hpp"
#include "io/modbus/server_device.hpp"
#include "tests/support/allocation_guard.hpp"

namespace hil::io::modbus {
namespace {

using test::frame;
using test::RawClient;

constexpr RunTimeNs ms = 1'000'000;

std::vector<std::string> texts(const Device& device) {
  std::vector<std::string> all;
  for (const DeviceEvent& event : device.events_since(0))
    all.push_back(event.text);
  return all;
}
using Texts = std::vector<std::string>;

/// A client and its unit, whose registers all hold `held`.
struct Unit {
  explicit Unit(RegisterMap map, milliseconds max_age = milliseconds(1000))
      : server([this](FakeConnection& connection, int) {
          for (Bytes request = connection.receive(); !request.empty(); request = connection.receive())
            connection.send(FakeConnection::reply_to(request, held.load()));
        }),
        client(settings(server.port(), max_age), std::move(map)) {
    client.start(clock, Pacing::lockstep);
  }
  static ClientSettings settings(std::uint16_t port, milliseconds max_age) {
    ClientSettings made = long_timeouts(port);
    made.max_age = max_age;
    return made;
  }
  void exchange(RunTimeNs time_ns, const std::vector<double>& values) {
    clock.set(time_ns);
    client.release_outputs(values, time_ns);
    ASSERT_TRUE(client.exchange(time_ns)) << client.fault();
  }

  std::atomic<std::uint16_t> held{0};
  SetClock clock;
  FakeServer server;
  ClientDevice client;
};

TEST(UnfitValues, ClientOutputsGiveOneEventPerEpisode) {
  RegisterMap map{{entry("torque", Table::holding, 0, ValueType::i16, true),
                   entry("valve", Table::holding, 1, ValueType::u16, true)}};
  map.entries[0].minimum = -100;
  map.entries[0].maximum = 100;
  Unit unit(map);
  unit.exchange(10 * ms, {1000, 65535});
  unit.exchange(20 * ms, {2000, 65535});
  unit.exchange(30 * ms, {3, 70000});
  unit.exchange(40 * ms, {-101, 70000});
  unit.exchange(50 * ms, {std::nan(""), 0});
  unit.exchange(60 * ms, {std::nan(""), 0});
  EXPECT_EQ(
      texts(unit.client),
      (Texts{"Modbus unit plc: register torque: 1000 is outside -100 to 100; 100 is written",
             "Modbus unit plc: register valve: 70000 is outside 0 to 65535; 65535 is written",
             "Modbus unit plc: register torque: -101 is outside -100 to 100; -100 is written",
             "Modbus unit plc: register torque: the value to write is not a number; the register keeps its "
             "value"}));
  EXPECT_EQ(unit.client.events_since(0)[0].time_ns, 10 * ms);
  EXPECT_EQ(unit.client.events_since(2).front().time_ns, 40 * ms);
  EXPECT_EQ(unit.client.counters().values.saturated_outputs, 5U);
  EXPECT_EQ(unit.client.counters().values.not_a_number_outputs, 2U);
  EXPECT_EQ(unit.client.counters().values.out_of_range_inputs, 0U);
}

TEST(UnfitValues, ClientInputsGiveOneEventPerEpisode) {
  RegisterMap map{{entry("level", Table::holding, 0, ValueType::u16, false),
                   entry("flow", Table::holding, 1, ValueType::f32, false)}};
  map.entries[0].maximum = 20'000;
  Unit unit(map);
  for (const std::uint16_t held : {std::uint16_t{5}, std::uint16_t{0x7FC0}, std::uint16_t{0x7FC0},
                                   std::uint16_t{7}, std::uint16_t{0x7FC0}}) {
    unit.held = held;  // 0x7FC07FC0 is a NaN
    unit.exchange(unit.clock.now_ns() + ms, {});
  }
  EXPECT_EQ(latched(unit.client)[0].value, 32'704.0);
  const Texts once{
      "Modbus unit plc: register level: 32704 is outside 0 to 20000; it is read as it is",
      "Modbus unit plc: register flow: the register holds no finite number; the signal keeps its last value"};
  EXPECT_EQ(texts(unit.client), (Texts{once[0], once[1], once[0], once[1]}));
  EXPECT_EQ(unit.client.counters().values.out_of_range_inputs, 3U);
  EXPECT_EQ(unit.client.counters().values.not_a_number_inputs, 3U);
}

TEST(UnfitValues, EventsAreListedUpToALimit) {
  RegisterMap map{{entry("torque", Table::holding, 0, ValueType::u16, true)}};
  Unit unit(map);
  for (int round = 0; round < 1010; ++round) {
    unit.exchange((2 * round + 1) * ms, {70000});
    unit.exchange((2 * round + 2) * ms, {0});
  }
  ASSERT_EQ(unit.client.events_since(0).size(), 1000U);
  EXPECT_EQ(unit.client.events_since(999)[0].text, "further events of this unit are not listed (limit 1000)");
  EXPECT_EQ(unit.client.counters().values.saturated_outputs, 1010U);
}

/// hil writes status; clients write the others.
struct Panel {
  Panel() : device({.name = "panel", .max_age = milliseconds(1000)}, map()) {
    device.start(clock, Pacing::realtime);
  }
  static RegisterMap map() {
    RegisterMap made{{entry("status", Table::holding, 0, ValueType::u16, true),
                      entry("level", Table::holding, 1, ValueType::u16, false),
                      entry("pair", Table::holding, 2, ValueType::u32, false),
                      entry("flow", Table::holding, 4, ValueType::f32, false),
                      entry("off", Table::coil, 0, ValueType::boolean, false)}};
    made.entries[1].maximum = 100;
    made.entries[2].minimum = 5;
    made.entries[2].safe_value = 70'000;
    made.entries[2].maximum = 70'000;
    made.entries[4].maximum = 0;
    return made;
  }
  RunningClock clock;
  ServerDevice device;
};

TEST(UnfitValues, ServerRefusesThemWithException3) {
  Panel panel;
  RawClient client(panel.device.port());
  const auto reply = [&](const Bytes& pdu) {
    client.send(frame(1, pdu));
    return client.receive_frame();
  };
  EXPECT_EQ(reply({6, 0, 1, 0, 100}), frame(1, {6, 0, 1, 0, 100}));
  const std::vector<std::pair<Bytes, std::uint8_t>> refused{
      {{6, 0, 1, 0, 101}, 0x86},                            // above
      {{22, 0, 1, 0xFF, 0xFF, 0x00, 0x00}, 0},              // a mask that changes nothing is in range
      {{22, 0, 1, 0, 0, 0x01, 0x00}, 0x96},                 // 256
      {{16, 0, 2, 0, 2, 4, 0, 0, 0, 4}, 0x90},              // below
      {{16, 0, 1, 0, 3, 6, 0, 7, 0, 2, 0, 0}, 0x90},        // one fits, the other does not
      {{16, 0, 4, 0, 2, 4, 0x7F, 0xC0, 0, 0}, 0x90},        // not a number
      {{6, 0, 2, 0xFF, 0xFF}, 0x86},                        // half of a value, the rest as it is
      {{23, 0, 0, 0, 1, 0, 1, 0, 1, 2, 0x01, 0x00}, 0x97},  // 256
      {{5, 0, 0, 0xFF, 0}, 0x85},
      {{15, 0, 0, 0, 1, 1, 1}, 0x8F}};
  std::uint64_t exceptions = 0;
  for (const auto& [pdu, function] : refused) {
    if (function == 0) {
      EXPECT_EQ(reply(pdu), frame(1, pdu));
      continue;
    }
    EXPECT_EQ(reply(pdu), frame(1, {function, 3})) << "function " << int{pdu[0]};
    ++exceptions;
  }
  EXPECT_EQ(reply({3, 0, 1, 0, 5}), frame(1, {3, 10, 0, 100, 0, 1, 0x11, 0x70, 0, 0, 0, 0}));
  const std::vector<Sample> samples = latched(panel.device);
  EXPECT_EQ(samples[0].value, 100.0);
  for (std::size_t other = 1; other < samples.size(); ++other)
    EXPECT_FALSE(samples[other].fresh) << panel.device.inputs()[other].name;
  EXPECT_EQ(panel.device.counters().by_code[3], exceptions);
  EXPECT_EQ(panel.device.counters().exceptions, exceptions);
}

TEST(UnfitValues, RefusedWritesGiveOneEventPerEpisode) {
  Panel panel;
  RawClient client(panel.device.port());
  for (const std::uint8_t level : Bytes{101, 102, 50, 103}) {
    client.send(frame(1, {6, 0, 1, 0, level}));
    client.receive_frame();
  }
  const std::string end = ", outside 0 to 100; it was answered with exception 3 and changed nothing";
  EXPECT_EQ(texts(panel.device), (Texts{"Modbus unit panel: register level: a client wrote 101" + end,
                                        "Modbus unit panel: register level: a client wrote 103" + end}));
}

TEST(UnfitValues, ServerOutputsGiveOneEventPerEpisode) {
  Panel panel;
  RawClient client(panel.device.port());
  for (const double status : {70'000.0, 80'000.0, 5.0}) {
    panel.device.release_outputs(std::vector{status}, 0);
    client.send(frame(1, {3, 0, 0, 0, 1}));
    client.receive_frame();
  }
  EXPECT_EQ(texts(panel.device),
            Texts{"Modbus unit panel: register status: 70000 is outside 0 to 65535; 65535 is written"});
  EXPECT_EQ(panel.device.value_counters().saturated_outputs, 2U);
}

/// Latches every 10 ms of run time up to `until_ns`, with an exchange every `period_ns`.
void cycle(Unit& unit, RunTimeNs until_ns, RunTimeNs period_ns) {
  for (RunTimeNs now = unit.clock.now_ns() + 10 * ms; now <= until_ns; now += 10 * ms) {
    unit.clock.set(now);
    if (now % period_ns == 0) unit.exchange(now, {});
    latched(unit.client);
  }
}

TEST(StaleValues, SlowUnitGivesOneEventPerEpisode) {
  Unit unit({{entry("a", Table::holding, 0, ValueType::u16, false),
              entry("b", Table::holding, 1, ValueType::u16, false),
              entry("c", Table::holding, 2, ValueType::u16, false)}},
            milliseconds(200));
  cycle(unit, 1'000 * ms, 100 * ms);
  EXPECT_EQ(unit.client.counters().stale_inputs, 0U);
  cycle(unit, 4'000 * ms, 400 * ms);  // alternately fresh and stale for 200 ms
  EXPECT_GE(unit.client.counters().stale_inputs, 3U * 7U);
  const std::string event =
      "Modbus unit plc: register a (and 2 more) was not read for longer than its max_age of 200 ms; it is "
      "stale and "
      "reads its safe value";
  EXPECT_EQ(texts(unit.client), Texts{event});
  EXPECT_EQ(unit.client.events_since(0)[0].time_ns, 1'410 * ms);
  cycle(unit, 5'000 * ms, 100 * ms);  // fresh: the episode ends
  EXPECT_EQ(texts(unit.client), Texts{event});
  cycle(unit, 6'000 * ms, 400 * ms);
  EXPECT_EQ(texts(unit.client), (Texts{event, event}));
}

TEST(StaleValues, ServerInputsGiveAnEvent) {
  Panel panel;
  RawClient client(panel.device.port());
  client.send(frame(1, {6, 0, 1, 0, 9}));
  client.receive_frame();
  EXPECT_TRUE(latched(panel.device)[0].fresh);
  EXPECT_TRUE(tests::eventually([&] { return !latched(panel.device)[0].fresh; }));
  EXPECT_EQ(texts(panel.device),
            Texts{"Modbus unit panel: register level was not written by a client for longer than "
                  "its max_age of 1000 ms; it is stale and reads its safe value"});
  EXPECT_EQ(panel.device.stale_inputs(), 1U);
}

TEST(StaleValues, LatchingThemAllocatesNothing) {
  Unit unit({{entry("a", Table::holding, 0, ValueType::u16, false)}}, milliseconds(50));
  unit.exchange(10 * ms, {});
  std::vector<Sample> samples(1);
  unit.client.latch_inputs(samples);
  ASSERT_TRUE(samples[0].fresh);
  unit.clock.set(100 * ms);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  unit.client.latch_inputs(samples);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_FALSE(samples[0].fresh);
  EXPECT_EQ(unit.client.counters().stale_inputs, 1U);
}

}  // namespace
}  // namespace hil::io::modbus
