// The client device against units that refuse requests with exceptions.

#include <gtest/gtest.h>

#include <atomic>

#include "client_exchange.hpp"

namespace hil::io::modbus {
namespace {

TEST(ClientRefusals, ExceptionIsReportedAndKeepsTheConnection) {
  RegisterMap map = two_words();
  map.entries.push_back(entry("other", Table::input, 0, ValueType::u16, false));
  FakeServer server([](FakeConnection& connection, int) {
    for (Bytes request = connection.receive(); !request.empty(); request = connection.receive()) {
      const auto id = static_cast<std::uint16_t>(request[0] << 8U | request[1]);
      connection.send(request[7] == 3 ? test::frame(id, {0x83, 2}) : FakeConnection::reply_to(request, 9));
    }
  });
  SetClock clock;
  ClientDevice client(long_timeouts(server.port()), map);
  client.start(clock, Pacing::lockstep);
  for (int round = 0; round < 3; ++round)
    ASSERT_TRUE(exchange_once(client, round, round).ok);
  EXPECT_FALSE(latched(client)[0].fresh);
  EXPECT_EQ(latched(client)[1].value, 9.0);
  EXPECT_EQ(client.counters().exceptions, 3U);
  EXPECT_EQ(client.counters().errors, 3U);
  EXPECT_EQ(client.counters().reconnects, 0U);
  EXPECT_EQ(client.counters().requests, client.counters().replies);
  const std::optional<RequestRange> first = client.counters().first_refused[2];
  ASSERT_TRUE(first);
  EXPECT_EQ(text_of(*first, client.map()), "reading in (holding 10)");
  EXPECT_TRUE(client.connected());
  EXPECT_NE(client.fault().find("reading in (holding 10): illegal data address (exception 2)"),
            std::string::npos)
      << client.fault();
}

TEST(ClientRefusals, OutputsRefusedForASecondAreASendFault) {
  std::atomic<bool> refuses{true};
  FakeServer server([&](FakeConnection& connection, int) {
    for (Bytes request = connection.receive(); !request.empty(); request = connection.receive()) {
      const auto id = static_cast<std::uint16_t>(request[0] << 8U | request[1]);
      connection.send(request[7] == 6 && refuses ? test::frame(id, {0x86, 4})
                                                 : FakeConnection::reply_to(request, 9));
    }
  });
  SetClock clock;
  ClientDevice client(long_timeouts(server.port()), two_words());
  client.start(clock, Pacing::lockstep);
  constexpr RunTimeNs ms = 1'000'000;
  ASSERT_TRUE(exchange_once(client, 1, 0).ok);
  ASSERT_TRUE(exchange_once(client, 2, 1'000 * ms).ok);
  refuses = false;
  ASSERT_TRUE(exchange_once(client, 3, 1'500 * ms).ok);
  refuses = true;
  ASSERT_TRUE(exchange_once(client, 4, 2'000 * ms).ok);
  EXPECT_EQ(client.send_fault(), "");
  ASSERT_TRUE(exchange_once(client, 5, 3'001 * ms).ok);
  EXPECT_NE(client.send_fault().find("has refused outputs for more than 1000 ms: writing out (holding 0): "),
            std::string::npos)
      << client.send_fault();
  EXPECT_TRUE(client.connected()) << "it answers";
}

/// A unit that has holding registers 0, 5 and 20 only.
void answer_without_gaps(FakeConnection& connection) {
  for (Bytes request = connection.receive(); !request.empty(); request = connection.receive()) {
    const auto id = static_cast<std::uint16_t>(request[0] << 8U | request[1]);
    const unsigned first = static_cast<unsigned>(request[8]) << 8U | request[9];
    const unsigned count = request[7] == 3 ? static_cast<unsigned>(request[10]) << 8U | request[11] : 1;
    const bool is_there = count == 1 && (first == 0 || first == 5 || first == 20);
    connection.send(is_there ? FakeConnection::reply_to(request, static_cast<std::uint16_t>(first + 1))
                             : test::frame(id, {static_cast<std::uint8_t>(request[7] | 0x80U), 2}));
  }
}

RegisterMap with_gaps() {
  return {{entry("w", Table::holding, 20, ValueType::u16, true),
           entry("a", Table::holding, 0, ValueType::u16, false),
           entry("b", Table::holding, 5, ValueType::u16, false)}};
}

TEST(ClientRefusals, RefusedReadAcrossGapsIsSplitForever) {
  FakeServer server([](FakeConnection& connection, int) { answer_without_gaps(connection); });
  SetClock clock;
  ClientSettings settings = long_timeouts(server.port());
  settings.max_gap = 8;
  ClientDevice client(settings, with_gaps());
  client.start(clock, Pacing::lockstep);
  for (int round = 1; round <= 3; ++round) {
    ASSERT_TRUE(exchange_once(client, round, round).ok);
    EXPECT_EQ(latched(client)[0].value, 1.0);
    EXPECT_EQ(latched(client)[1].value, 6.0);
    EXPECT_EQ(client.fault(), "");
    EXPECT_EQ(client.counters().by_code[2], 1U) << "once, in the first cycle";
    EXPECT_EQ(client.counters().requests, 1U + 3U * static_cast<unsigned>(round));
  }
  const std::vector<DeviceEvent> events = client.events_since(0);
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].text,
            "Modbus unit plc: it refused to read holding 0..5 (exception 2), which has gaps; from now on it "
            "is read in "
            "2 requests");
}

TEST(ClientRefusals, ReadsCrossGapsOnlyIfAllowed) {
  FakeServer server([](FakeConnection& connection, int) { answer_without_gaps(connection); });
  SetClock clock;
  ClientDevice client(long_timeouts(server.port()), with_gaps());
  client.start(clock, Pacing::lockstep);
  ASSERT_TRUE(exchange_once(client, 1, 1).ok);
  EXPECT_EQ(client.counters().exceptions, 0U);
  EXPECT_EQ(latched(client)[1].value, 6.0);
}

}  // namespace
}  // namespace hil::io::modbus
