// The client device against the server device. external_tools_test.cpp has foreign programs as peers.
#include "io/modbus/client_device.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <random>

#include "io/modbus/server_device.hpp"
#include "registers.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::modbus {
namespace {

using std::chrono::milliseconds;
using test::entry;
using test::latched;
using tests::eventually;

/// The client's view of a unit.
RegisterMap unit_map() {
  RegisterMap map{{entry("torque", Table::holding, 0, ValueType::f32, true),
                   entry("ticket", Table::holding, 2, ValueType::u32, true),
                   entry("brake", Table::coil, 3, ValueType::boolean, true),
                   entry("enable", Table::coil, 4, ValueType::boolean, true),
                   entry("speed", Table::input, 7, ValueType::i16, false),
                   entry("odometer", Table::holding, 20, ValueType::f64, false),
                   entry("door", Table::discrete_input, 1, ValueType::boolean, false)}};
  map.entries[1].order = ByteOrder::cdab;
  map.entries[4].scale = 0.01;
  map.entries[4].unit = "m/s";
  map.entries[4].safe_value = -1.0;
  map.entries[5].order = ByteOrder::dcba;
  map.entries[0].minimum = -100.0;
  map.entries[0].maximum = 100.0;
  return map;
}

/// The server's view: it reads what the client writes.
RegisterMap server_view(RegisterMap map) {
  for (RegisterEntry& one : map.entries)
    one.writable = !one.writable;
  return map;
}

struct Pair {
  explicit Pair(Pacing pacing, ClientSettings client_settings = {}, const RegisterMap& map = unit_map())
      : server({.name = "unit"}, server_view(map)) {
    server.start(wall, Pacing::realtime);
    client_settings.name = "plc";
    client_settings.endpoint.port = server.port();
    client = std::make_unique<ClientDevice>(client_settings, map);
    client->start(pacing == Pacing::lockstep ? static_cast<const RunClock&>(hand) : wall, pacing);
  }
  ~Pair() {
    client->stop();
    server.stop();
  }

  RunningClock wall;
  SetClock hand;
  ServerDevice server;
  std::unique_ptr<ClientDevice> client;
};

TEST(ClientDevice, ChannelsFollowTheMap) {
  ClientSettings settings;
  settings.name = "plc";
  const ClientDevice client(settings, unit_map());
  ASSERT_EQ(client.outputs().size(), 4U);
  ASSERT_EQ(client.inputs().size(), 3U);
  EXPECT_EQ(client.outputs()[1].name, "ticket");
  EXPECT_EQ(client.inputs()[0].name, "speed");
  EXPECT_EQ(client.inputs()[0].unit, "m/s");
  EXPECT_EQ(client.inputs()[0].safe_value, -1.0);
  EXPECT_EQ(client.outputs()[0].maximum, 100.0);
}

TEST(ClientDevice, InputsHaveTheirSafeValueBeforeTheFirstReply) {
  Pair pair(Pacing::lockstep);
  const std::vector<Sample> samples = latched(*pair.client);
  EXPECT_EQ(samples[0].value, -1.0);
  EXPECT_FALSE(samples[0].fresh);
}

TEST(ClientDevice, LockstepCarriesRandomValuesBothWays) {
  Pair pair(Pacing::lockstep);
  std::mt19937 random(3);
  for (int round = 1; round <= 200; ++round) {
    const RunTimeNs tick_ns = round * 50'000'000LL;
    pair.hand.set(tick_ns);
    const std::vector<double> to_client{
        static_cast<double>(static_cast<int>(random() % 60000) - 30000) / 100.0,
        static_cast<double>(random()) / 7.0, static_cast<double>(random() % 2)};
    const std::vector<double> to_server{static_cast<double>(static_cast<int>(random() % 200) - 100) / 2.0,
                                        static_cast<double>(random()), static_cast<double>(random() % 2),
                                        static_cast<double>(random() % 2)};
    pair.server.release_outputs(to_client, tick_ns);
    pair.client->release_outputs(to_server, tick_ns);
    ASSERT_TRUE(pair.client->exchange(tick_ns)) << pair.client->fault();
    const std::vector<Sample> at_client = latched(*pair.client);
    for (std::size_t i = 0; i < to_client.size(); ++i) {
      ASSERT_NEAR(at_client[i].value, to_client[i], 1e-9) << "input " << i;
      ASSERT_TRUE(at_client[i].fresh);
      ASSERT_EQ(at_client[i].time_ns, tick_ns);
    }
    const std::vector<Sample> at_server = latched(pair.server);
    for (std::size_t i = 0; i < to_server.size(); ++i)
      ASSERT_EQ(at_server[i].value, to_server[i]) << "output " << i;
  }
  EXPECT_EQ(pair.client->counters().errors, 0U);
  EXPECT_EQ(pair.client->counters().reconnects, 0U);
  EXPECT_EQ(pair.client->counters().requests, pair.client->counters().replies);
}

/// The specification reserves 248 to 254; over TCP they are in use.
TEST(ClientDevice, EveryUnitIdentifierIsSent) {
  for (int unit = 0; unit <= 255; unit += unit == 1 ? 246 : 1) {
    Pair pair(Pacing::lockstep, {.unit = static_cast<std::uint8_t>(unit)});
    pair.client->release_outputs(std::vector<double>{1, 2, 0, 0}, 0);
    EXPECT_TRUE(pair.client->exchange(0)) << unit << ": " << pair.client->fault();
    EXPECT_EQ(latched(pair.server)[1].value, 2.0);
  }
}

TEST(ClientDevice, ExchangeWithoutAReleaseSendsNothing) {
  Pair pair(Pacing::lockstep);
  pair.client->release_outputs(std::vector<double>{1, 2, 0, 0}, 0);
  ASSERT_TRUE(pair.client->exchange(0));
  const std::uint64_t before = pair.client->counters().requests;
  EXPECT_GT(before, 0U);
  ASSERT_TRUE(pair.client->exchange(1'000'000));
  EXPECT_EQ(pair.client->counters().requests, before);
}

TEST(ClientDevice, WritesChangedRegistersOnlyByDefault) {
  const std::vector<double> values{1, 2, 0, 1};
  for (const bool write_unchanged : {false, true}) {
    Pair pair(Pacing::lockstep, {.write_unchanged = write_unchanged});
    pair.client->release_outputs(values, 0);
    ASSERT_TRUE(pair.client->exchange(0));
    const std::uint64_t first = pair.client->counters().requests;
    EXPECT_EQ(first, 5U);  // coils, holding; discrete inputs, holding, inputs
    pair.client->release_outputs(values, 1);
    ASSERT_TRUE(pair.client->exchange(1));
    EXPECT_EQ(pair.client->counters().requests - first, write_unchanged ? 5U : 3U);
  }
}

TEST(ClientDevice, SaturatedAndRefusedValuesAreCounted) {
  Pair pair(Pacing::lockstep);
  pair.client->release_outputs(std::vector<double>{50, 7, 0, 0}, 0);
  ASSERT_TRUE(pair.client->exchange(0));
  pair.client->release_outputs(std::vector<double>{1000, std::nan(""), 1, 0}, 1);
  ASSERT_TRUE(pair.client->exchange(1));
  const std::vector<Sample> at_server = latched(pair.server);
  EXPECT_EQ(at_server[0].value, 100.0) << "the maximum";
  EXPECT_EQ(at_server[1].value, 7.0) << "a NaN keeps the last value";
  EXPECT_EQ(at_server[2].value, 1.0);
  EXPECT_EQ(pair.client->counters().values.saturated_outputs, 1U);
  EXPECT_EQ(pair.client->counters().values.not_a_number_outputs, 1U);
}

TEST(ClientDevice, InputsBecomeStaleByTheirAge) {
  Pair pair(Pacing::lockstep, {.max_age = milliseconds(200)});
  pair.server.release_outputs(std::vector<double>{3.5, 1, 1}, 0);
  pair.client->release_outputs(std::vector<double>{0, 0, 0, 0}, 0);
  ASSERT_TRUE(pair.client->exchange(0));
  pair.hand.set(200'000'000);
  EXPECT_TRUE(latched(*pair.client)[0].fresh);
  EXPECT_NEAR(latched(*pair.client)[0].value, 3.5, 1e-9);
  EXPECT_EQ(latched(*pair.client)[0].time_ns, 0);
  pair.hand.set(200'000'001);
  EXPECT_FALSE(latched(*pair.client)[0].fresh);
  EXPECT_EQ(latched(*pair.client)[0].value, -1.0);
}

TEST(ClientDevice, SafeStateReplacesEarlierReleases) {
  RegisterMap map = unit_map();
  map.entries[0].safe_value = -12.5;
  map.entries[2].safe_value = 1.0;
  for (const Pacing pacing : {Pacing::realtime, Pacing::lockstep}) {
    Pair pair(pacing, {}, map);
    pair.client->release_outputs(std::vector<double>{5, 6, 0, 1}, 0);
    ASSERT_TRUE(pacing == Pacing::realtime || pair.client->exchange(0));
    ASSERT_TRUE(eventually([&] { return latched(pair.server)[0].value == 5.0; }));
    pair.client->enter_safe_state();
    ASSERT_TRUE(eventually([&] { return latched(pair.server)[0].value == -12.5; }));
    ASSERT_TRUE(eventually([&] { return latched(pair.server)[1].value == 0.0; }));
    EXPECT_TRUE(eventually([&] { return latched(pair.server)[2].value == 1.0; }));
    pair.client->release_outputs(std::vector<double>{7, 6, 0, 1}, 1);
    ASSERT_TRUE(pacing == Pacing::realtime || pair.client->exchange(1));
    EXPECT_TRUE(eventually([&] { return latched(pair.server)[0].value == 7.0; }));
  }
}

TEST(ClientDevice, StopSendsEarlierReleases) {
  Pair pair(Pacing::realtime);
  for (int round = 1; round <= 50; ++round) {
    pair.client->release_outputs(std::vector<double>{1.0 * round, 0, 0, 0}, round);
    pair.client->stop();
    ASSERT_TRUE(eventually([&] { return latched(pair.server)[0].value == round; }, milliseconds(100)));
    pair.client->stop();  // a second stop does nothing
    pair.client->start(pair.wall, Pacing::realtime);
  }
}

TEST(ClientDevice, SendsHeartbeatAndRunTime) {
  RegisterMap map = unit_map();
  map.entries.push_back(entry("alive", Table::holding, 4, ValueType::u16, true));
  map.entries.back().minimum = 1;
  map.entries.back().safe_value = 1;
  map.entries.back().maximum = 3;
  map.entries.push_back(entry("time", Table::holding, 5, ValueType::u32, true));
  ClientSettings settings;
  settings.run_time_ms_entry = "time";
  settings.heartbeat_entry = "alive";
  Pair pair(Pacing::lockstep, settings, map);
  ASSERT_EQ(pair.client->outputs().size(), 4U);
  std::vector<double> beats;
  for (int round = 1; round <= 7; ++round) {
    const RunTimeNs tick_ns = round * 50'000'000LL;
    pair.client->release_outputs(std::vector<double>{1, 2, 0, 0}, tick_ns);
    ASSERT_TRUE(pair.client->exchange(tick_ns));
    const std::vector<Sample> at_server = latched(pair.server);
    beats.push_back(at_server[4].value);
    EXPECT_EQ(at_server[5].value, 50.0 * round);
    EXPECT_GE(at_server[5].time_ns, at_server[4].time_ns) << "the time was written before the outputs";
  }
  EXPECT_EQ(beats, (std::vector<double>{2, 3, 1, 2, 3, 1, 2}));
}

TEST(ClientDevice, RealtimeExchangesRunBesideTheTick) {
  Pair pair(Pacing::realtime);
  double sent = 0;
  EXPECT_TRUE(eventually([&] {
    sent += 1.0;
    pair.server.release_outputs(std::vector<double>{0.01 * sent, sent, 1}, 0);
    pair.client->release_outputs(std::vector<double>{0, sent, 0, 0}, 0);
    latched(*pair.client);
    return pair.client->counters().requests > 100;
  }));
  EXPECT_TRUE(eventually([&] { return latched(pair.server)[1].value == sent; }));
  pair.client->release_outputs(std::vector<double>{0, sent, 0, 0}, 0);
  EXPECT_TRUE(eventually([&] { return std::abs(latched(*pair.client)[0].value - 0.01 * sent) < 1e-9; }));
  EXPECT_TRUE(latched(*pair.client)[0].fresh);
  EXPECT_TRUE(pair.client->connected());
  EXPECT_EQ(pair.client->fault(), "");
  EXPECT_TRUE(
      eventually([&] { return pair.client->counters().requests == pair.client->counters().replies; }));
}

void construct(const std::function<void(ClientSettings&, RegisterMap&)>& change) {
  ClientSettings settings;
  settings.name = "plc";
  RegisterMap map = unit_map();
  change(settings, map);
  const ClientDevice client(settings, map);
}

TEST(ClientDeviceDeathTest, MisuseEndsTheProgram) {
  EXPECT_DEATH(construct([](ClientSettings&, RegisterMap& map) { map.entries[0].scale = 0.0; }), "mistakes");
  EXPECT_DEATH(construct([](ClientSettings& settings, RegisterMap&) { settings.heartbeat_entry = "speed"; }),
               "not a writable entry");
  EXPECT_DEATH(
      construct([](ClientSettings& settings, RegisterMap&) { settings.response_timeout = milliseconds(0); }),
      "not positive");
}

}  // namespace
}  // namespace hil::io::modbus
