// The client device against servers that misbehave, each by a script.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "client_exchange.hpp"
#include "io/modbus/server_device.hpp"

namespace hil::io::modbus {
namespace {

/// A first connection by `fault`, all later ones sound with the value 7: the exchange fails within the limit,
/// the fault is counted and named, and a later exchange is right again.
void expect_one_lost_exchange(const std::function<void(FakeConnection&)>& fault, bool is_timeout,
                              const char* words) {
  FakeServer server(
      [&](FakeConnection& connection, int index) { index == 0 ? fault(connection) : behave(connection, 7); });
  SetClock clock;
  ClientDevice client(quick(server.port()), two_words());
  client.start(clock, Pacing::lockstep);
  const Exchange first = exchange_once(client, 1, 0);
  EXPECT_FALSE(first.good);
  EXPECT_LT(first.took, milliseconds(250));
  EXPECT_EQ(client.counters().timeouts, is_timeout ? 1U : 0U);
  EXPECT_EQ(client.counters().errors, is_timeout ? 0U : 1U);
  EXPECT_FALSE(client.connected());
  EXPECT_NE(client.fault().find(words), std::string::npos) << client.fault();
  EXPECT_NE(client.fault().find("plc"), std::string::npos) << client.fault();
  // The fake server may still be busy with the connection it spoilt.
  EXPECT_TRUE(eventually([&] { return exchange_once(client, 2, 1).good; })) << client.fault();
  EXPECT_EQ(latched(client)[0].value, 7.0);
  EXPECT_GE(client.counters().reconnects, 1U);
  EXPECT_EQ(client.fault(), "");
  client.stop();
}

TEST(ClientFaults, ASilentServerIsATimeOut) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        connection.receive();
        connection.receive();  // waits for the client to give up
      },
      true, "writing holding 0: no complete reply within 30 ms");
}

TEST(ClientFaults, AServerKilledMidReplyIsAnError) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        Bytes reply = FakeConnection::reply_to(connection.receive(), 1);
        reply.resize(reply.size() / 2);
        connection.send(reply);
      },
      false, "closed the connection");
}

TEST(ClientFaults, ASlowLorisIsBoundedByTheResponseTimeOut) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        for (const std::uint8_t byte : FakeConnection::reply_to(connection.receive(), 1)) {
          connection.send({byte});
          std::this_thread::sleep_for(milliseconds(10));  // whole after 120 ms, each gap far below the limit
        }
      },
      true, "no complete reply within 30 ms");
}

TEST(ClientFaults, AWrongTransactionIdIsNoAnswer) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        Bytes reply = FakeConnection::reply_to(connection.receive(), 1);
        reply[1] ^= 0x40U;
        connection.send(reply);
        connection.receive();
      },
      false, "does not fit the request");
}

TEST(ClientFaults, AnotherFunctionIsNoAnswer) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        Bytes reply = FakeConnection::reply_to(connection.receive(), 1);
        reply[7] = 5;
        connection.send(reply);
        connection.receive();
      },
      false, "does not fit the request");
}

TEST(ClientFaults, AnExceptionOfAnotherFunctionIsNoAnswer) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        const Bytes request = connection.receive();
        connection.send(bench::frame(static_cast<std::uint16_t>(request[0] << 8U | request[1]), {0x83, 2}));
        connection.receive();
      },
      false, "the reply does not fit the request: function 131, not 6");
}

TEST(ClientFaults, AnExceptionThatTheProtocolDoesNotHaveIsNoAnswer) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        const Bytes request = connection.receive();
        connection.send(bench::frame(static_cast<std::uint16_t>(request[0] << 8U | request[1]), {0x86, 12}));
        connection.receive();
      },
      false, "exception that the protocol does not have");
}

/// The reply to the first request, a write, with one byte changed.
void expect_lost_when(std::size_t byte, std::uint8_t changed, const char* words) {
  expect_one_lost_exchange(
      [=](FakeConnection& connection) {
        Bytes reply = FakeConnection::reply_to(connection.receive(), 1);
        reply[byte] = changed;
        connection.send(reply);
        connection.receive();
      },
      false, words);
}

TEST(ClientFaults, AReplyThatRepeatsSomethingElseIsNoAnswer) {
  expect_lost_when(3, 5, "does not fit the request: protocol 5, not 0");
  expect_lost_when(4, 0xFF, "does not fit the request: length ");
  expect_lost_when(5, 7, "does not fit the request: length 7, not 6");
  expect_lost_when(6, 9, "does not fit the request: unit identifier 9, not ");
  expect_lost_when(9, 1, "it repeats another address or value than was written");
  expect_lost_when(11, 0xEE, "it repeats another address or value than was written");
}

TEST(ClientFaults, TooFewRegistersAreNoAnswer) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        connection.send(FakeConnection::reply_to(connection.receive(), 1));
        const Bytes read = connection.receive();
        connection.send(
            bench::frame(static_cast<std::uint16_t>(read[0] << 8U | read[1]), {3, 4, 0, 1, 0, 2}));
        connection.receive();
      },
      false, "reading holding 10: the reply does not fit");
}

TEST(ClientFaults, NoiseIsNoAnswer) {
  expect_one_lost_exchange(
      [](FakeConnection& connection) {
        connection.receive();
        connection.send(Bytes(300, 0xA5));
        connection.receive();
      },
      false, "does not");
}

TEST(ClientFaults, AHalfOpenConnectionIsNoticed) {
  // The server accepts and goes away without a word, as after a power cut: nothing is read, nothing answered.
  expect_one_lost_exchange([](FakeConnection&) { std::this_thread::sleep_for(milliseconds(60)); }, true,
                           "no complete reply within 30 ms");
}

/// The reply to each request comes after the time-out, with the value of the request's order. No reply may
/// ever be taken for another's: an input must show a value of its own connection's read, or nothing.
TEST(ClientFaults, LateReplyIsNeverTakenForALaterRequest) {
  constexpr std::uint16_t late_value = 666;
  std::atomic<int> late_replies{0};
  FakeServer server([&](FakeConnection& connection, int index) {
    if (index >= 3) return behave(connection, 7);
    connection.send(FakeConnection::reply_to(connection.receive(), 0));  // the write, in time
    const Bytes read = connection.receive();
    std::this_thread::sleep_for(milliseconds(45));
    connection.send(FakeConnection::reply_to(read, late_value));
    late_replies.fetch_add(1);
    connection.receive();
  });
  RunningClock clock;
  ClientDevice client(quick(server.port()), two_words());
  client.start(clock, Pacing::realtime);
  for (int tick = 0; tick < 200 && server.connections() < 4; ++tick) {
    client.release_outputs(std::vector{1.0 * tick}, 0);
    EXPECT_NE(latched(client)[0].value, late_value);
    std::this_thread::sleep_for(milliseconds(5));
  }
  client.release_outputs(std::vector{1.0}, 0);
  EXPECT_TRUE(eventually([&] { return latched(client)[0].value == 7.0; }));
  EXPECT_EQ(late_replies.load(), 3);
  EXPECT_GE(client.counters().timeouts, 3U);  // more on a busy machine
  EXPECT_GE(client.counters().reconnects, 3U);
  client.stop();
}

TEST(ClientFaults, DuplicateReplyClosesTheConnection) {
  FakeServer server([](FakeConnection& connection, int index) {
    if (index > 0) return behave(connection, 7);
    connection.send(FakeConnection::reply_to(connection.receive(), 0));
    const Bytes reply = FakeConnection::reply_to(connection.receive(), 5);
    Bytes twice = reply;
    twice.insert(twice.end(), reply.begin(), reply.end());
    connection.send(twice);
    connection.receive();
  });
  SetClock clock;
  ClientDevice client(patient(server.port()), two_words());
  client.start(clock, Pacing::lockstep);
  ASSERT_TRUE(exchange_once(client, 1, 0).good);
  EXPECT_EQ(latched(client)[0].value, 5.0);
  ASSERT_TRUE(eventually([&] { return exchange_once(client, 2, 1).good; }));
  EXPECT_EQ(latched(client)[0].value, 7.0);
  EXPECT_EQ(client.counters().reconnects, 1U);
  client.stop();
}

TEST(ClientFaults, ResponseTimeoutIsKeptToTheMillisecond) {
  // libmodbus wants seconds and microseconds; a mistake there makes it 0 or seconds.
  for (const milliseconds limit : {milliseconds(3), milliseconds(30), milliseconds(1200)}) {
    FakeServer server([](FakeConnection& connection, int) {
      connection.receive();
      connection.receive();
    });
    SetClock clock;
    ClientSettings settings = quick(server.port());
    settings.response_timeout = limit;
    settings.lockstep_limit = milliseconds(3000);
    ClientDevice client(settings, two_words());
    client.start(clock, Pacing::lockstep);
    const Exchange one = exchange_once(client, 1, 0);
    EXPECT_FALSE(one.good);
    EXPECT_EQ(client.counters().timeouts, 1U);
    EXPECT_GE(one.took, limit - milliseconds(1));
    EXPECT_LT(one.took, limit + milliseconds(300));
    client.stop();
  }
}

TEST(ClientFaults, ExchangeEndsAtItsLimit) {
  FakeServer server([](FakeConnection& connection, int) {
    connection.receive();
    connection.receive();
  });
  SetClock clock;
  ClientSettings settings = quick(server.port());
  settings.response_timeout = milliseconds(4000);
  settings.lockstep_limit = milliseconds(50);
  ClientDevice client(settings, two_words());
  client.start(clock, Pacing::lockstep);
  const Exchange one = exchange_once(client, 1, 0);
  EXPECT_FALSE(one.good);
  EXPECT_GE(one.took, milliseconds(49));
  EXPECT_LT(one.took, milliseconds(500));
  client.stop();
}

TEST(ClientFaults, StartReportsAnUnreachableUnit) {
  std::uint16_t port = 0;
  {
    const FakeServer gone([](FakeConnection&, int) {});
    port = gone.port();
  }
  RunningClock clock;
  ClientSettings settings = quick(port);
  settings.start_limit = milliseconds(60);
  ClientDevice client(settings, two_words());
  std::string refusal;
  const auto before = Wall::now();
  try {
    client.start(clock, Pacing::realtime);
  } catch (const DeviceError& error) {
    refusal = error.what();
  }
  const auto took = Wall::now() - before;
  EXPECT_EQ(refusal,
            "Modbus unit plc (127.0.0.1:" + std::to_string(port) +
                ") can not be reached: Connection refused; tried for 60 ms. Check that the unit is on and "
                "that the address and port are right");
  EXPECT_LT(took, milliseconds(1000));
}

TEST(ClientFaults, ReturningUnitGetsAllOutputsAgain) {
  RegisterMap map = two_words();
  RegisterMap turned = map;
  for (RegisterEntry& one : turned.entries)
    one.writable = !one.writable;
  RunningClock clock;
  auto server = std::make_unique<ServerDevice>(ServerSettings{.name = "unit"}, turned);
  server->start(clock, Pacing::realtime);
  const std::uint16_t port = server->port();
  ClientSettings settings = quick(port);
  settings.max_age = milliseconds(50);
  ClientDevice client(settings, map);
  client.start(clock, Pacing::realtime);
  client.release_outputs(std::vector{41.0}, 0);
  ASSERT_TRUE(eventually([&] { return latched(*server)[0].value == 41.0; }));
  server.reset();
  ASSERT_TRUE(eventually([&] {
    client.release_outputs(std::vector{41.0}, 0);
    return !client.connected();
  }));
  EXPECT_NE(client.fault(), "");
  EXPECT_TRUE(eventually([&] { return !latched(client)[0].fresh; }));
  server =
      std::make_unique<ServerDevice>(ServerSettings{.name = "unit", .endpoint = {"127.0.0.1", port}}, turned);
  server->start(clock, Pacing::realtime);
  // Nothing new is released: the device retries by itself and sends the unit its outputs again.
  EXPECT_TRUE(eventually([&] { return latched(*server)[0].value == 41.0; }));
  EXPECT_TRUE(eventually([&] { return client.connected() && client.fault().empty(); }));
  EXPECT_GE(client.counters().reconnects, 1U);
  client.stop();
}

TEST(ClientFaults, PausesBetweenAttemptsGrow) {
  // The server accepts and closes at once, without end.
  FakeServer server([](FakeConnection&, int) {});
  RunningClock clock;
  ClientDevice client(quick(server.port()), two_words());
  client.start(clock, Pacing::realtime);
  const auto begun = std::chrono::steady_clock::now();
  client.release_outputs(std::vector{1.0}, 0);
  // The pauses are 5, 10, 20, 40, 40, ... ms: they grow at first, and not for ever.
  ASSERT_TRUE(eventually([&] { return server.connections() >= 10; }));
  EXPECT_GE(std::chrono::steady_clock::now() - begun, milliseconds(5 + 10 + 20 + 5 * 40)) << "a busy loop";
  client.stop();
}

TEST(ClientFaults, SilentUnitDelaysNeitherTheTickNorOtherUnits) {
  FakeServer dead([](FakeConnection& connection, int) {
    connection.receive();
    connection.receive();
  });
  FakeServer alive([](FakeConnection& connection, int) { behave(connection, 7); });
  RunningClock clock;
  ClientSettings slow = quick(dead.port());
  slow.response_timeout = milliseconds(300);
  ClientDevice first(slow, two_words());
  ClientDevice second(quick(alive.port()), two_words());
  first.start(clock, Pacing::realtime);
  second.start(clock, Pacing::realtime);
  std::vector<Sample> samples(1);
  const std::vector value{1.0};
  std::vector<std::int64_t> tick_ns;
  for (int tick = 0; tick < 500; ++tick) {
    const auto before = Wall::now();
    first.release_outputs(value, tick);
    first.latch_inputs(samples);
    second.release_outputs(value, tick);
    second.latch_inputs(samples);
    tick_ns.push_back(std::chrono::nanoseconds(Wall::now() - before).count());
    std::this_thread::sleep_for(milliseconds(1));
  }
  EXPECT_TRUE(samples[0].fresh);
  EXPECT_EQ(samples[0].value, 7.0);
  EXPECT_GT(second.counters().replies, 100U);
  EXPECT_GE(first.counters().timeouts, 1U);
  EXPECT_GT(first.counters().superseded_releases, 100U);
  // Four calls. The median, since a busy machine takes the processor away now and then; waiting for the dead
  // unit would show as hundreds of milliseconds.
  std::nth_element(tick_ns.begin(), tick_ns.begin() + 250, tick_ns.end());
  EXPECT_LT(tick_ns[250], 1'000'000);
  const auto before = Wall::now();
  first.stop();
  EXPECT_LT(Wall::now() - before, milliseconds(1200));
  second.stop();
}

}  // namespace
}  // namespace hil::io::modbus
