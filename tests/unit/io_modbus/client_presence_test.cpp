// Whether the client reports its unit as connected: at the start, during a long cycle, and without inputs.
#include <gtest/gtest.h>

#include <atomic>

#include "client_exchange.hpp"

namespace hil::io::modbus {
namespace {

constexpr RunTimeNs ms = 1'000'000;

TEST(ClientPresence, UnitIsConnectedFromTheStartAndAnswersFirst) {
  FakeServer server([](FakeConnection& connection, int) { answer_all(connection, 7); });
  SetClock clock;
  ClientDevice client(long_timeouts(server.port()), two_words());
  client.start(clock, Pacing::lockstep);
  EXPECT_TRUE(client.connected());
  EXPECT_FALSE(client.has_answered());
  EXPECT_TRUE(exchange_once(client, 1, 0).ok);
  EXPECT_TRUE(client.has_answered());
}

TEST(ClientPresence, SilentUnitHasNeverAnswered) {
  FakeServer server([](FakeConnection& connection, int) { connection.receive(), connection.receive(); });
  SetClock clock;
  ClientDevice client(short_timeouts(server.port()), two_words());
  client.start(clock, Pacing::lockstep);
  EXPECT_FALSE(exchange_once(client, 1, 0).ok);
  EXPECT_FALSE(client.connected());
  EXPECT_FALSE(client.has_answered());
}

TEST(ClientPresence, ReleaseOlderThanMaxAgeDisconnectsUntilTheCycleEnds) {
  std::atomic<bool> may_reply{false};
  FakeServer server([&](FakeConnection& connection, int) {
    const Bytes request = connection.receive();
    eventually([&] { return may_reply.load(); });
    connection.send(FakeConnection::reply_to(request, 7));
    answer_all(connection, 7);
  });
  SetClock clock;
  ClientSettings settings = long_timeouts(server.port());
  settings.max_age = milliseconds(100);
  ClientDevice client(settings, two_words());
  client.start(clock, Pacing::realtime);
  clock.set(1'000 * ms);
  EXPECT_TRUE(client.connected()) << "nothing has been released";
  client.release_outputs(std::vector{1.0}, 1'000 * ms);
  clock.set(1'050 * ms);
  client.release_outputs(std::vector{2.0}, 1'050 * ms);
  clock.set(1'100 * ms);
  EXPECT_TRUE(client.connected());
  clock.set(1'101 * ms);
  EXPECT_FALSE(client.connected());
  EXPECT_NE(client.fault().find("no cycle has ended for more than 100 ms"), std::string::npos)
      << client.fault();
  may_reply.store(true);
  EXPECT_TRUE(eventually([&] { return client.connected(); }));
  EXPECT_TRUE(eventually([&] { return client.fault().empty(); }));
}

TEST(ClientPresence, UnchangedOutputsAreRepeatedToAUnitWithoutInputs) {
  std::atomic<int> requests{0};
  FakeServer server([&](FakeConnection& connection, int) {
    while (requests < 2) {
      const Bytes request = connection.receive();
      if (request.empty()) return;
      ++requests;
      connection.send(FakeConnection::reply_to(request, 0));
    }
    connection.receive();  // silent, and the connection stays open
    connection.receive();
  });
  SetClock clock;
  ClientSettings settings = short_timeouts(server.port());
  settings.max_age = milliseconds(100);
  ClientDevice client(settings, {{entry("out", Table::holding, 0, ValueType::u16, true)}});
  client.start(clock, Pacing::lockstep);
  for (RunTimeNs tick = 0; tick < 50; tick += 10)
    EXPECT_TRUE(exchange_once(client, 1, tick * ms).ok);
  EXPECT_EQ(requests, 1) << "nothing changed";
  EXPECT_TRUE(exchange_once(client, 1, 50 * ms).ok);
  EXPECT_EQ(requests, 2);
  EXPECT_TRUE(exchange_once(client, 1, 99 * ms).ok);
  EXPECT_FALSE(exchange_once(client, 1, 100 * ms).ok);
  EXPECT_FALSE(client.connected());
}

}  // namespace
}  // namespace hil::io::modbus
