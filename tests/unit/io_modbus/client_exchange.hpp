#pragma once
// A client with one output and one input, servers for it, and single exchanges in lock-step.

#include <chrono>
#include <cstdint>
#include <vector>

#include "bench.hpp"
#include "io/modbus/client_device.hpp"

namespace hil::io::modbus {

using bench::Bytes;
using bench::entry;
using bench::eventually;
using bench::FakeConnection;
using bench::FakeServer;
using bench::latched;
using std::chrono::milliseconds;
using Wall = std::chrono::steady_clock;

inline RegisterMap two_words() {
  return {{entry("out", Table::holding, 0, ValueType::u16, true),
           entry("in", Table::holding, 10, ValueType::u16, false)}};
}

inline ClientSettings quick(std::uint16_t port) {
  ClientSettings settings;
  settings.name = "plc";
  settings.endpoint.port = port;
  settings.response_timeout = milliseconds(30);
  settings.start_limit = milliseconds(500);
  settings.reconnect_pause_min = milliseconds(5);
  settings.reconnect_pause_max = milliseconds(40);
  settings.lockstep_limit = milliseconds(100);
  return settings;
}

/// For a server that answers: no machine is so busy that it takes that long.
inline ClientSettings patient(std::uint16_t port) {
  ClientSettings settings = quick(port);
  settings.response_timeout = milliseconds(5000);
  settings.lockstep_limit = milliseconds(10'000);
  return settings;
}

/// Serves soundly until the client leaves.
inline void behave(FakeConnection& connection, std::uint16_t value) {
  for (Bytes request = connection.receive(); !request.empty(); request = connection.receive()) {
    connection.send(FakeConnection::reply_to(request, value));
  }
}

/// One lockstep exchange: what it returned, and how long it took.
struct Exchange {
  bool good = false;
  milliseconds took{0};
};

inline Exchange exchange_once(ClientDevice& client, double value, RunTimeNs tick_ns) {
  const auto before = Wall::now();
  client.release_outputs(std::vector{value}, tick_ns);
  const bool good = client.exchange(tick_ns);
  return {good, std::chrono::duration_cast<milliseconds>(Wall::now() - before)};
}

}  // namespace hil::io::modbus
