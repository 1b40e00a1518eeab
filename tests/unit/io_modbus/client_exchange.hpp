#pragma once
// Settings of a client with one output and one input, a server that answers, and single exchanges in
// lock-step.

#include <chrono>
#include <cstdint>
#include <vector>

#include "io/modbus/client_device.hpp"
#include "peers.hpp"
#include "registers.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::modbus {

using std::chrono::milliseconds;
using test::Bytes;
using test::entry;
using test::FakeConnection;
using test::FakeServer;
using test::latched;
using tests::eventually;
using Wall = std::chrono::steady_clock;

inline RegisterMap two_words() {
  return {{entry("out", Table::holding, 0, ValueType::u16, true),
           entry("in", Table::holding, 10, ValueType::u16, false)}};
}

inline ClientSettings short_timeouts(std::uint16_t port) {
  ClientSettings settings;
  settings.name = "plc";
  settings.endpoint.port = port;
  settings.response_timeout = milliseconds(30);
  settings.start_timeout = milliseconds(5000);
  settings.reconnect_pause_min = milliseconds(5);
  settings.reconnect_pause_max = milliseconds(40);
  settings.lockstep_limit = milliseconds(100);
  return settings;
}

/// For a server that answers: longer than a busy machine delays a reply.
inline ClientSettings long_timeouts(std::uint16_t port) {
  ClientSettings settings = short_timeouts(port);
  settings.response_timeout = milliseconds(5000);
  settings.lockstep_limit = milliseconds(10'000);
  return settings;
}

/// Sends valid replies until the client closes the connection.
inline void answer_all(FakeConnection& connection, std::uint16_t value) {
  for (Bytes request = connection.receive(); !request.empty(); request = connection.receive()) {
    connection.send(FakeConnection::reply_to(request, value));
  }
}

/// The result and the duration of one exchange in lock-step.
struct Exchange {
  bool ok = false;
  milliseconds duration{0};
};

inline Exchange exchange_once(ClientDevice& client, double value, RunTimeNs tick_ns) {
  const auto before = Wall::now();
  client.release_outputs(std::vector{value}, tick_ns);
  const bool ok = client.exchange(tick_ns);
  return {ok, std::chrono::duration_cast<milliseconds>(Wall::now() - before)};
}

}  // namespace hil::io::modbus
