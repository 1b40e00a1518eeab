#pragma once
// The other sides of the Modbus devices under test, in this process and without libmodbus: a client, and a
// server that follows a script.

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <thread>
#include <utility>
#include <vector>

#include "io/modbus/tcp_endpoint.hpp"

namespace hil::io::modbus::test {

using Bytes = std::vector<std::uint8_t>;
using std::chrono::milliseconds;

/// A blocking client socket, every operation bounded by 5 s.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port);
  void send(const Bytes& bytes);
  /// The next complete frame; empty when the peer closed the connection or sent none within the limit.
  Bytes receive_frame(milliseconds limit = milliseconds(5000));
  /// True when the peer closes the connection within the limit. Reads and discards what arrives before.
  bool closed_within(milliseconds limit);
  int fd() const { return socket_.get(); }

 private:
  Descriptor socket_;
};

/// Transaction id, unit 1, and the protocol data unit.
Bytes frame(std::uint16_t transaction, const Bytes& pdu);

/// A connection of FakeServer.
class FakeConnection {
 public:
  explicit FakeConnection(Descriptor socket) : socket_(std::move(socket)) {}
  /// The next request; empty when the client closed the connection or sent none for 5 s.
  Bytes receive();
  void send(const Bytes& bytes);
  /// The valid reply to a request: the echo of a write, or `value` in every register that is read. Empty for
  /// no request.
  static Bytes reply_to(const Bytes& request, std::uint16_t value);

 private:
  Descriptor socket_;
};

/// Runs `script` for each connection, one after the other, in a thread.
class FakeServer {
 public:
  using Script = std::function<void(FakeConnection&, int connection_index)>;
  explicit FakeServer(Script script);
  ~FakeServer();
  std::uint16_t port() const { return port_; }
  int connections() const { return connections_.load(); }

 private:
  Descriptor listener_;
  std::uint16_t port_ = 0;
  Script script_;
  std::atomic<bool> stop_{false};
  std::atomic<int> connections_{0};
  std::thread thread_;
};

}  // namespace hil::io::modbus::test
