// The server device with misbehaving clients, which must not affect a well-behaved client.
#include <gtest/gtest.h>
#include <sys/socket.h>

#include <memory>
#include <random>

#include "bench.hpp"
#include "io/modbus/server_device.hpp"

namespace hil::io::modbus {
namespace {

using bench::Bytes;
using bench::entry;
using bench::eventually;
using bench::frame;
using bench::RawClient;
using std::chrono::milliseconds;
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

milliseconds answer_time(RawClient& client) {
  const auto before = Wall::now();
  client.send(frame(77, {3, 0, 0, 0, 4}));
  EXPECT_EQ(client.receive_frame().size(), 17U);
  return std::chrono::duration_cast<milliseconds>(Wall::now() - before);
}

TEST(ServerFaults, MalformedRequestsAreAnsweredAndKeepTheConnection) {
  Served served;
  RawClient client(served.device.port());
  const std::vector<std::pair<Bytes, Bytes>> cases{
      {{7}, {0x87, 1}},              // libmodbus 3.1.6 never answers it
      {{17, 1}, {0x91, 3}},          // too long
      {{3, 0, 0}, {0x83, 3}},        // short
      {{3, 0, 0, 0, 0}, {0x83, 3}},  // nothing: libmodbus sleeps 500 ms before this answer
      {{99, 1, 2, 3}, {0xE3, 1}},    // unknown: it sleeps here, too
      {{0}, {0x80, 1}},
      {{16, 0, 0, 0, 2, 200, 1}, {0x90, 3}},            // a byte count that lies
      {{23, 0, 0, 0, 4, 0, 0, 0, 4, 8, 1}, {0x97, 3}},  // short write and read
      {{4, 0, 4, 0, 1}, {0x84, 2}}};
  for (const auto& [request, reply] : cases) {
    const auto before = Wall::now();
    client.send(frame(5, request));
    EXPECT_EQ(client.receive_frame(), frame(5, reply));
    EXPECT_LT(Wall::now() - before, milliseconds(250));
  }
  EXPECT_LT(answer_time(client), milliseconds(250));
  EXPECT_EQ(served.device.counters().exceptions, cases.size());
}

/// 0x83 is the function byte of an exception to function 3. An answer of 3, 1, 3, 1 would be a good reply.
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
  EXPECT_LT(answer_time(client), milliseconds(250));
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
    std::this_thread::sleep_for(milliseconds(1));
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
  RawClient loris(served.device.port());
  RawClient sound(served.device.port());
  const auto before = Wall::now();
  const Bytes bytes = frame(1, Bytes(200, 16));
  std::size_t sent = 0;
  while (!loris.closed_within(milliseconds(10)) && sent < bytes.size()) {
    loris.send({bytes[sent++]});
    ASSERT_LT(answer_time(sound), milliseconds(90));
  }
  EXPECT_LT(sent, bytes.size()) << "the connection was never closed";
  EXPECT_LT(Wall::now() - before, milliseconds(1000));
  EXPECT_EQ(served.device.counters().dropped_silent, 1U);
}

TEST(ServerFaults, DropsSilentClientsAndKeepsActiveOnes) {
  Served served({.idle_limit = milliseconds(150)});
  RawClient silent(served.device.port());
  RawClient busy(served.device.port());
  EXPECT_TRUE(eventually([&] {
    answer_time(busy);
    return served.device.counters().dropped_silent == 1;
  }));
  EXPECT_TRUE(silent.closed_within(milliseconds(10)));
  EXPECT_EQ(served.device.counters().dropped_silent, 1U);
  EXPECT_LT(answer_time(busy), milliseconds(150));
}

TEST(ServerFaults, RefusesConnectionsBeyondTheLimitUntilOneCloses) {
  Served served({.max_connections = 3});
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 3; ++i) {
    clients.push_back(std::make_unique<RawClient>(served.device.port()));
    answer_time(*clients.back());
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
    EXPECT_LT(answer_time(*client), milliseconds(250));
}

TEST(ServerFaults, ServesSixtyFourClients) {
  Served served;
  std::vector<std::unique_ptr<RawClient>> clients;
  for (int i = 0; i < 64; ++i)
    clients.push_back(std::make_unique<RawClient>(served.device.port()));
  for (int round = 0; round < 2; ++round) {
    for (const auto& client : clients)
      answer_time(*client);
  }
  EXPECT_EQ(served.device.counters().refused, 0U);
  EXPECT_EQ(served.device.counters().replaced, 0U);
}

TEST(ServerFaults, NewClientReplacesTheLongestIdleOne) {
  Served served({.max_connections = 3});
  RawClient first(served.device.port());
  RawClient second(served.device.port());
  RawClient third(served.device.port());
  answer_time(third);
  answer_time(first);
  std::this_thread::sleep_for(milliseconds(1050));  // replaceable_after is 1 s
  answer_time(second);
  RawClient fourth(served.device.port());
  answer_time(fourth);
  EXPECT_TRUE(third.closed_within(milliseconds(1000))) << "it was idle for longer than the first";
  EXPECT_EQ(served.device.counters().replaced, 1U);
  EXPECT_EQ(served.device.counters().refused, 0U);
  for (RawClient* kept : {&first, &second, &fourth})
    answer_time(*kept);
  RawClient fifth(served.device.port());
  EXPECT_TRUE(fifth.closed_within(milliseconds(1000))) << "all others were busy a moment ago";
  EXPECT_EQ(served.device.counters().refused, 1U);
}

TEST(ServerFaults, DropsAClientThatReadsNoRepliesWithoutDelayingOthers) {
  Served served({.idle_limit = milliseconds(1500)});
  RawClient deaf(served.device.port());
  RawClient sound(served.device.port());
  const int small = 4096;
  ::setsockopt(deaf.fd(), SOL_SOCKET, SO_RCVBUF, &small, sizeof(small));
  Bytes burst;
  for (std::uint16_t i = 0; i < 500; ++i) {
    const Bytes next = frame(i, {3, 0, 0, 0, 4});
    burst.insert(burst.end(), next.begin(), next.end());
  }
  std::size_t at = 0;
  EXPECT_TRUE(eventually(
      [&] {
        // Goes on where the last send stopped: the stream stays sound, only its replies are not taken.
        const ssize_t sent =
            ::send(deaf.fd(), burst.data() + at, burst.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent > 0) at = (at + static_cast<std::size_t>(sent)) % burst.size();
        EXPECT_LT(answer_time(sound), milliseconds(500));
        // Now and then the kernel of the deaf side, its buffer full, takes no acknowledgements either, and
        // its requests stop before a reply is refused: then it is dropped as silent.
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
  RawClient sound(served.device.port());
  EXPECT_LT(answer_time(sound), milliseconds(500));
}

TEST(ServerFaults, ClosedClientsFreeTheirConnections) {
  Served served({.max_connections = 2});
  for (int round = 0; round < 50; ++round) {
    RawClient client(served.device.port());
    client.send({0, 1, 0, 0, 0});
  }
  RawClient sound(served.device.port());  // at once: the dead ones before it in the queue cost it nothing
  EXPECT_LT(answer_time(sound), milliseconds(500));
}

}  // namespace
}  // namespace hil::io::modbus
