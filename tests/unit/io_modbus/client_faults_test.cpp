// The client device against servers that send invalid replies or none, each by a script.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "client_exchange.hpp"
#include "io/modbus/server_device.hpp"

namespace hil::io::modbus {
namespace {

using Script = std::function<void(FakeConnection&)>;

/// Answers the first request, a write, with `reply` of the request, and then waits until the client has
/// closed.
Script replying(const std::function<Bytes(const Bytes& request)>& reply) {
  return [=](FakeConnection& connection) {
    connection.send(reply(connection.receive()));
    connection.receive();
  };
}

/// The valid reply with one byte changed.
Script changed_byte(std::size_t index, std::uint8_t value) {
  return replying([=](const Bytes& request) {
    Bytes reply = FakeConnection::reply_to(request, 1);
    reply[index] = value;
    return reply;
  });
}

Bytes reply_frame(const Bytes& request, const Bytes& pdu) {
  return test::frame(static_cast<std::uint16_t>(request[0] << 8U | request[1]), pdu);
}

void close_after_half_a_reply(FakeConnection& connection) {
  Bytes reply = FakeConnection::reply_to(connection.receive(), 1);
  reply.resize(reply.size() / 2);
  connection.send(reply);
}

void answer_too_few_registers(FakeConnection& connection) {
  connection.send(FakeConnection::reply_to(connection.receive(), 1));
  connection.send(reply_frame(connection.receive(), {3, 4, 0, 1, 0, 2}));
  connection.receive();
}

void stay_silent(FakeConnection& connection) {
  connection.receive();
  connection.receive();  // empty when the client has closed
}

/// The whole reply takes 120 ms, and each pause is far below the response time-out.
void send_byte_by_byte(FakeConnection& connection) {
  for (const std::uint8_t byte : FakeConnection::reply_to(connection.receive(), 1)) {
    connection.send({byte});
    std::this_thread::sleep_for(milliseconds(10));
  }
}

struct Fault {
  const char* name;
  Script script;
  const char* text;  ///< part of the client's fault
  bool is_timeout = false;
};

TEST(ClientFaults, InvalidRepliesFailOneExchangeAndTheNextConnectionIsValid) {
  const Fault faults[] = {
      {"silence", stay_silent, "writing out (holding 0): no complete reply within 30 ms", true},
      {"slow bytes", send_byte_by_byte, "no complete reply within 30 ms", true},
      {"connection closed in the reply", close_after_half_a_reply, "closed the connection"},
      {"too few registers", answer_too_few_registers, "reading in (holding 10): the reply does not fit"},
      {"noise", replying([](const Bytes&) { return Bytes(300, 0xA5); }), "does not"},
      {"exception of another function", replying([](const Bytes& request) {
         return reply_frame(request, {0x83, 2});
       }),
       "the reply does not fit the request: function 131, not 6"},
      {"unknown exception", replying([](const Bytes& request) {
         return reply_frame(request, {0x86, 12});
       }),
       "exception that the protocol does not have"},
      {"transaction", changed_byte(1, 0xEE), "does not fit the request"},
      {"protocol", changed_byte(3, 5), "does not fit the request: protocol 5, not 0"},
      {"long length", changed_byte(4, 0xFF), "does not fit the request: length "},
      {"length", changed_byte(5, 7), "does not fit the request: length 7, not 6"},
      {"unit", changed_byte(6, 9), "does not fit the request: unit identifier 9, not "},
      {"function", changed_byte(7, 5), "does not fit the request"},
      {"address", changed_byte(9, 1), "it repeats another address or value than was written"},
      {"value", changed_byte(11, 0xEE), "it repeats another address or value than was written"}};
  for (const Fault& fault : faults) {
    SCOPED_TRACE(fault.name);
    FakeServer server([&](FakeConnection& connection, int index) {
      index == 0 ? fault.script(connection) : answer_all(connection, 7);
    });
    SetClock clock;
    // Only a fault that is a time-out may time out: a busy machine delays the replies of the others.
    ClientDevice client(fault.is_timeout ? short_timeouts(server.port()) : long_timeouts(server.port()),
                        two_words());
    client.start(clock, Pacing::lockstep);
    EXPECT_FALSE(exchange_once(client, 1, 0).ok);
    EXPECT_EQ(client.counters().timeouts, fault.is_timeout ? 1U : 0U);
    EXPECT_EQ(client.counters().errors, fault.is_timeout ? 0U : 1U);
    EXPECT_FALSE(client.connected());
    EXPECT_NE(client.fault().find(fault.text), std::string::npos) << client.fault();
    EXPECT_NE(client.fault().find("plc"), std::string::npos) << client.fault();
    EXPECT_TRUE(eventually([&] { return exchange_once(client, 2, 1).ok; })) << client.fault();
    EXPECT_EQ(latched(client)[0].value, 7.0);
    EXPECT_GE(client.counters().reconnects, 1U);
    EXPECT_EQ(client.fault(), "");
  }
}

TEST(ClientFaults, NameTheTimeOutThatWasSet) {
  FakeServer server([](FakeConnection& connection, int) { stay_silent(connection); });
  RunningClock clock;
  ClientSettings settings = long_timeouts(server.port());
  settings.lockstep_limit = milliseconds(40);
  ClientDevice client(settings, two_words());
  client.start(clock, Pacing::lockstep);
  EXPECT_FALSE(exchange_once(client, 1, 0).ok);
  EXPECT_NE(client.fault().find("no complete reply within 40 ms"), std::string::npos) << client.fault();
}

/// Three connections reply after the client's time-out. An input shows a value that was read on
/// its connection, or its safe value.
TEST(ClientFaults, LateReplyIsNeverTakenForALaterRequest) {
  constexpr std::uint16_t late_value = 666;
  std::atomic<std::uint64_t> timeouts{0};
  FakeServer server([&](FakeConnection& connection, int index) {
    if (index >= 3) return answer_all(connection, 7);
    connection.send(FakeConnection::reply_to(connection.receive(), 0));  // the write, in time
    const Bytes read = connection.receive();
    const std::uint64_t before = timeouts.load();
    EXPECT_TRUE(eventually([&] { return timeouts.load() > before; }));
    connection.send(FakeConnection::reply_to(read, late_value));
    connection.receive();
  });
  RunningClock clock;
  ClientDevice client(short_timeouts(server.port()), two_words());
  client.start(clock, Pacing::realtime);
  double output = 0.0;
  EXPECT_TRUE(eventually([&] {
    client.release_outputs(std::vector{output += 1.0}, 0);
    timeouts = client.counters().timeouts;
    EXPECT_NE(latched(client)[0].value, late_value);
    return latched(client)[0].value == 7.0;
  }));
  EXPECT_GE(client.counters().timeouts, 3U);
  EXPECT_GE(client.counters().reconnects, 3U);
}

TEST(ClientFaults, DuplicateReplyClosesTheConnection) {
  FakeServer server([](FakeConnection& connection, int index) {
    if (index > 0) return answer_all(connection, 7);
    connection.send(FakeConnection::reply_to(connection.receive(), 0));
    const Bytes reply = FakeConnection::reply_to(connection.receive(), 5);
    Bytes twice = reply;
    twice.insert(twice.end(), reply.begin(), reply.end());
    connection.send(twice);
    connection.receive();
  });
  SetClock clock;
  ClientDevice client(long_timeouts(server.port()), two_words());
  client.start(clock, Pacing::lockstep);
  ASSERT_TRUE(exchange_once(client, 1, 0).ok);
  EXPECT_EQ(latched(client)[0].value, 5.0);
  ASSERT_TRUE(eventually([&] { return exchange_once(client, 2, 1).ok; }));
  EXPECT_EQ(latched(client)[0].value, 7.0);
  EXPECT_EQ(client.counters().reconnects, 1U);
}

/// Both limits in real time, which is their subject: a conversion to the wrong unit makes them 0 or a
/// thousand times as long.
TEST(ClientFaults, ResponseTimeoutAndExchangeLimitAreKept) {
  struct Limits {
    milliseconds response_timeout, exchange_limit;
  };
  for (const Limits limits :
       {Limits{milliseconds(3), milliseconds(3000)}, Limits{milliseconds(30), milliseconds(3000)},
        Limits{milliseconds(1200), milliseconds(5000)}, Limits{milliseconds(4000), milliseconds(50)}}) {
    const milliseconds expected = std::min(limits.response_timeout, limits.exchange_limit);
    SCOPED_TRACE(expected.count());
    FakeServer server([](FakeConnection& connection, int) { stay_silent(connection); });
    SetClock clock;
    ClientSettings settings = short_timeouts(server.port());
    settings.response_timeout = limits.response_timeout;
    settings.lockstep_limit = limits.exchange_limit;
    ClientDevice client(settings, two_words());
    client.start(clock, Pacing::lockstep);
    const Exchange one = exchange_once(client, 1, 0);
    EXPECT_FALSE(one.ok);
    EXPECT_EQ(client.counters().timeouts, 1U);
    // Real time is the subject.
    EXPECT_GE(one.duration, expected - milliseconds(1));
    EXPECT_LT(one.duration, expected + milliseconds(1500));
  }
}

TEST(ClientFaults, StartReportsAnUnreachableUnit) {
  std::uint16_t port = 0;
  {
    const FakeServer gone([](FakeConnection&, int) {});
    port = gone.port();
  }
  RunningClock clock;
  ClientSettings settings = short_timeouts(port);
  settings.start_timeout = milliseconds(60);
  ClientDevice client(settings, two_words());
  std::string refusal;
  try {
    client.start(clock, Pacing::realtime);
  } catch (const DeviceError& error) {
    refusal = error.what();
  }
  EXPECT_EQ(refusal,
            "Modbus unit plc (127.0.0.1:" + std::to_string(port) +
                ") can not be reached: Connection refused; tried for 60 ms. Check that the unit is on and "
                "that the address and port are right");
}

TEST(ClientFaults, StartEndsWhenAStopIsRequested) {
  std::uint16_t port = 0;
  {
    const FakeServer gone([](FakeConnection&, int) {});
    port = gone.port();
  }
  RunningClock clock;
  std::atomic<bool> stop_requested{false};
  ClientSettings settings = short_timeouts(port);
  settings.start_timeout = std::chrono::hours(1);
  settings.stop_requested = &stop_requested;
  ClientDevice client(settings, two_words());
  std::string refusal;
  std::thread starting([&] {
    try {
      client.start(clock, Pacing::realtime);
    } catch (const DeviceError& error) {
      refusal = error.what();
    }
  });
  stop_requested = true;
  starting.join();
  EXPECT_EQ(refusal, "the run was stopped before Modbus unit plc (127.0.0.1:" + std::to_string(port) +
                         ") was reached: Connection refused");
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
  ClientSettings settings = short_timeouts(port);
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
}

TEST(ClientFaults, PausesBetweenAttemptsGrow) {
  // The server accepts and closes at once, without end.
  FakeServer server([](FakeConnection&, int) {});
  RunningClock clock;
  ClientDevice client(short_timeouts(server.port()), two_words());
  client.start(clock, Pacing::realtime);
  const auto begun = std::chrono::steady_clock::now();
  client.release_outputs(std::vector{1.0}, 0);
  // The pauses are 5, 10, 20, 40, 40, ... ms.
  ASSERT_TRUE(eventually([&] { return server.connections() >= 10; }));
  EXPECT_GE(std::chrono::steady_clock::now() - begun, milliseconds(5 + 10 + 20 + 5 * 40));
}

TEST(ClientFaults, SilentUnitDelaysNeitherTheTickNorOtherUnits) {
  FakeServer silent([](FakeConnection& connection, int) { stay_silent(connection); });
  FakeServer answering([](FakeConnection& connection, int) { answer_all(connection, 7); });
  RunningClock clock;
  ClientSettings slow = short_timeouts(silent.port());
  slow.response_timeout = milliseconds(300);
  ClientDevice first(slow, two_words());
  ClientDevice second(long_timeouts(answering.port()), two_words());
  first.start(clock, Pacing::realtime);
  second.start(clock, Pacing::realtime);
  std::vector<Sample> samples(1);
  const std::vector value{1.0};
  std::vector<std::int64_t> tick_ns;
  // A tick of about a millisecond.
  EXPECT_TRUE(eventually([&] {
    const auto before = Wall::now();
    first.release_outputs(value, 0);
    first.latch_inputs(samples);
    second.release_outputs(value, 0);
    second.latch_inputs(samples);
    tick_ns.push_back(std::chrono::nanoseconds(Wall::now() - before).count());
    return second.counters().replies > 100 && first.counters().timeouts >= 1 &&
           first.counters().superseded_releases > 100;
  }));
  EXPECT_TRUE(samples[0].fresh);
  EXPECT_EQ(samples[0].value, 7.0);
  // Real time is the subject. The median of four calls: the machine may interrupt some ticks. Waiting for
  // the silent unit would take hundreds of milliseconds.
  const auto median = tick_ns.begin() + static_cast<std::ptrdiff_t>(tick_ns.size() / 2);
  std::ranges::nth_element(tick_ns, median);
  EXPECT_LT(*median, 1'000'000);
  const auto before = Wall::now();
  first.stop();
  EXPECT_LT(Wall::now() - before, milliseconds(1200));
}

}  // namespace
}  // namespace hil::io::modbus
