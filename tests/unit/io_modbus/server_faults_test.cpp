// The server device with clients that send invalid requests, stop sending, or stop reading. The time of its
// replies to other clients is real time: sockets have no simulated one.
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <memory>
#include <random>

#include "io/modbus/server_device.hpp"
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
using test::RawClient;
using tests::eventually;
using Wall = std::chrono::steady_clock;

struct Served {
  explicit Served(ServerLimits limits = {})
      : device({.name = "panel", .limits = limits}, {{entry("a", Table::holding, 0, ValueType::u64, false),
                                                      entry("b", Table::input, 0, ValueType::f64, true)}}) {
    device.start(clock, Pacing::realtime);
  }
  RunningClock clock;
  ServerDevice device;
};

/// Shorter than the 500 ms that libmodbus sleeps before some of its replies.
constexpr milliseconds response_limit(450);

milliseconds response_time(RawClient& client) {
  const auto before = Wall::now();
  client.send(frame(77, {3, 0, 0, 0, 4}));
  EXPECT_EQ(client.receive_frame().size(), 17U);
  return std::chrono::duration_cast<milliseconds>(Wall::now() - before);
}

TEST(ServerFaults, MalformedRequestsAreAnsweredAndKeepTheConnection) {
  Served served;
  RawClient client(served.device.port());
  const std::vector<std::pair<Bytes, Bytes>> cases{
      {{7}, {0x87, 1}},              // libmodbus 3.1.6 does not answer it
      {{17, 1}, {0x91, 3}},          // too long
      {{3, 0, 0}, {0x83, 3}},        // short
      {{3, 0, 0, 0, 0}, {0x83, 3}},  // nothing
      {{99, 1, 2, 3}, {0xE3, 1}},    // unknown
      {{0}, {0x80, 1}},
      {{16, 0, 0, 0, 2, 200, 1}, {0x90, 3}},            // a wrong byte count
      {{23, 0, 0, 0, 4, 0, 0, 0, 4, 8, 1}, {0x97, 3}},  // short write and read
      {{4, 0, 4, 0, 1}, {0x84, 2}}};
  for (const auto& [request, reply] : cases) {
    const auto before = Wall::now();
    client.send(frame(5, request));
    EXPECT_EQ(client.receive_frame(), frame(5, reply));
    EXPECT_LT(Wall::now() - before, response_limit);
  }
  EXPECT_LT(response_time(client), response_limit);
  EXPECT_EQ(served.device.counters().exceptions, cases.size());
}

/// 0x83 is the function byte of an exception to function 3. A reply of 3, 1, 3, 1 would be a valid reply.
TEST(ServerFaults, FunctionsAbove7FGetException1) {
  Served served;
  RawClient client(served.device.port());
  for (unsigned function = 0x80; function <= 0xFF; ++function) {
    const auto byte = static_cast<std::uint8_t>(function);
    for (const Bytes& pdu : {Bytes{byte}, Bytes{byte, 0, 0, 0, 1}}) {
      client.send(frame(5, pdu));
      EXPECT_EQ(client.receive_frame(), frame(5, {byte, 1}));
    }
  }
  EXPECT_LT(response_time(client), response_limit);
  EXPECT_EQ(served.device.counters().by_code[1], 256U);
}

TEST(ServerFaults, ReportServerIdIsAnswered) {
  Served served;
  RawClient client(served.device.port());
  client.send(frame(5, {17}));
  const Bytes reply = client.receive_frame();
  ASSERT_GT(reply.size(), 10U);
  EXPECT_EQ(reply[7], 17);
  EXPECT_EQ(reply[8], reply.size() - 9);
}

TEST(ServerFaults, InvalidFramesCloseTheConnection) {
  Served served;
  const std::vector<Bytes> noises{
      {'G', 'E', 'T', ' ', '/', ' ', 'H', 'T'}, {0, 1, 0, 0, 0, 1, 1}, {0, 1, 0, 0, 9, 9, 1}};
  for (const Bytes& noise : noises) {
    RawClient client(served.device.port());
    client.send(noise);
    EXPECT_TRUE(client.closed_within(milliseconds(1000)));
  }
  EXPECT_EQ(served.device.counters().malformed, noises.size());
}

TEST(ServerFaults, SplitAndJoinedFramesAreAnsweredInOrder) {
  Served served;
  RawClient client(served.device.port());
  const Bytes one = frame(1, {16, 0, 0, 0, 4, 8, 1, 2, 3, 4, 5, 6, 7, 8});
  for (const std::uint8_t byte : one) {
    client.send({byte});
    std::this_thread::sleep_for(milliseconds(1));  // the server receives single bytes
  }
  EXPECT_EQ(client.receive_frame(), frame(1, {16, 0, 0, 0, 4}));
  Bytes many;
  for (std::uint16_t i = 0; i < 100; ++i) {
    const Bytes next = frame(i, {3, 0, 0, 0, 4});
    many.insert(many.end(), next.begin(), next.end());
  }
  client.send(many);
  for (std::uint16_t i = 0; i < 100; ++i) {
    ASSERT_EQ(client.receive_frame(), frame(i, {3, 8, 1, 2, 3, 4, 5, 6, 7, 8}));
  }
}

TEST(ServerFaults, DropsAClientThatTricklesBytesWithoutDelayingOthers) {
  Served served({.frame_limit = milliseconds(100)});
  RawClient slow(served.device.port());
  RawClient valid(served.device.port());
  // Real time is the subject: a slow client delays no other one.
  const auto before = Wall::now();
  const Bytes bytes = frame(1, Bytes(200, 16));
  std::size_t sent = 0;
  while (!slow.closed_within(milliseconds(10)) && sent < bytes.size()) {
    slow.send({bytes[sent++]});
    ASSERT_LT(response_time(valid), milliseconds(90));
  }
  EXPECT_LT(sent, bytes.size()) << "the connection is not closed";
  EXPECT_LT(Wall::now() - before, milliseconds(1000));
  EXPECT_EQ(served.device.counters().dropped_silent, 1U);
}

TEST(ServerFaults, DropsSilentClientsAndKeepsActiveOnes) {
  Served served({.idle_limit = milliseconds(150)});
  RawClient silent(served.device.port());
  RawClient busy(served.device.port());
  EXPECT_TRUE(eventually([&] {
    response_time(busy);
    return served.device.counters().dropped_silent == 1;
  }));
  EXPECT_TRUE(silent.closed_within(milliseconds(10)));
  EXPECT_EQ(served.device.counters().dropped_silent, 1U);
  // Real time is the subject: a client that is active within the idle limit keeps its connection.
  EXPECT_LT(response_time(busy), milliseconds(150));
}

TEST(ServerFaults, RefusesConnectionsBeyondTheLimitUntilOneCloses) {
  Served served({.max_connections = 3});
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(std::make_unique<RawClient>(served.device.port()));
    response_time(*clients.back());
  }
  RawClient refused(served.device.port());
  EXPECT_TRUE(refused.closed_within(milliseconds(1000)));
  EXPECT_EQ(served.device.counters().refused, 1U);
  clients.pop_back();
  EXPECT_TRUE(eventually([&] {
    RawClient next(served.device.port());
    next.send(frame(1, {3, 0, 0, 0, 1}));
    return !next.receive_frame(milliseconds(200)).empty();
  }));
  for (const auto& client : clients)
    EXPECT_LT(response_time(*client), response_limit);
}

TEST(ServerFaults, ServesSixtyFourClients) {
  Served served;
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 64; ++i)
    clients.push_back(std::make_unique<RawClient>(served.device.port()));
  for (int round = 0; round < 2; ++round) {
    for (const auto& client : clients)
      response_time(*client);
  }
  EXPECT_EQ(served.device.counters().refused, 0U);
  EXPECT_EQ(served.device.counters().replaced, 0U);
}

TEST(ServerFaults, NewClientReplacesTheLongestIdleOne) {
  Served served({.max_connections = 3, .replaceable_after = milliseconds(1)});
  RawClient first(served.device.port());
  RawClient second(served.device.port());
  RawClient third(served.device.port());
  for (RawClient* client : {&third, &first, &second})
    response_time(*client);
  std::this_thread::sleep_for(milliseconds(2));  // real time is the subject: replaceable_after
  RawClient fourth(served.device.port());
  response_time(fourth);
  EXPECT_TRUE(third.closed_within(milliseconds(1000))) << "idle for longer than the first";
  EXPECT_EQ(served.device.counters().replaced, 1U);
  EXPECT_EQ(served.device.counters().refused, 0U);
  for (RawClient* kept : {&first, &second, &fourth})
    response_time(*kept);
}

TEST(ServerFaults, DropsAClientThatReadsNoRepliesWithoutDelayingOthers) {
  Served served({.idle_limit = milliseconds(1500)});
  RawClient not_reading(served.device.port());
  RawClient valid(served.device.port());
  const int small = 4096;
  ::setsockopt(not_reading.fd(), SOL_SOCKET, SO_RCVBUF, &small, sizeof(small));
  Bytes burst;
  for (std::uint16_t i = 0; i < 500; ++i) {
    const Bytes next = frame(i, {3, 0, 0, 0, 4});
    burst.insert(burst.end(), next.begin(), next.end());
  }
  std::size_t at = 0;
  EXPECT_TRUE(eventually(
      [&] {
        // Continues where the last send stopped: all requests are valid, and no reply is read.
        const ssize_t sent =
            ::send(not_reading.fd(), burst.data() + at, burst.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0) at = (at + static_cast<std::size_t>(sent)) % burst.size();
        EXPECT_LT(response_time(valid), response_limit);
        // When the full receive buffer stops the requests before a reply fails, the server drops the client
        // as silent.
        return served.device.counters().dropped_not_reading + served.device.counters().dropped_silent == 1;
      },
      milliseconds(20'000)));
}

TEST(ServerFaults, SurvivesNoiseFromManyClients) {
  Served served({.max_connections = 8});
  std::mt19937 random(4711);
  const std::array<std::uint8_t, 12> functions{1, 2, 3, 4, 5, 6, 7, 15, 16, 17, 22, 23};
  for (int round = 0; round < 60; ++round) {
    RawClient client(served.device.port());
    for (int i = 0; i < 20; ++i) {
      Bytes pdu{functions[random() % functions.size()]};
      const std::size_t length = random() % 252;
      for (std::size_t k = 0; k < length; ++k)
        pdu.push_back(static_cast<std::uint8_t>(random() % 4 == 0 ? random() : 0));
      Bytes bytes = frame(static_cast<std::uint16_t>(random()), pdu);
      if (random() % 8 == 0) bytes[random() % bytes.size()] ^= static_cast<std::uint8_t>(1U << random() % 8);
      if (random() % 8 == 0) bytes.resize(random() % bytes.size());
      client.send(bytes);
    }
    ::shutdown(client.fd(), SHUT_WR);
    ASSERT_TRUE(client.closed_within(milliseconds(2000))) << "round " << round;
  }
  EXPECT_GT(served.device.counters().requests, 100U);
  RawClient valid(served.device.port());
  EXPECT_LT(response_time(valid), response_limit);
}

TEST(ServerFaults, ClosedClientsFreeTheirConnections) {
  Served served({.max_connections = 2});
  for (int round = 0; round < 50; ++round) {
    RawClient client(served.device.port());
    client.send({0, 1, 0, 0, 0});
  }
  RawClient valid(served.device.port());  // behind the closed connections in the accept queue
  EXPECT_LT(response_time(valid), response_limit);
}

}  // namespace
}  // namespace hil::io::modbus
