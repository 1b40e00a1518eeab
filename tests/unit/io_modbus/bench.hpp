#pragma once
// Shared by the tests of this folder: clocks, sockets without libmodbus, a server that follows a script,
// processes.

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "io/device.hpp"
#include "io/modbus/register_map.hpp"
#include "io/modbus/tcp_endpoint.hpp"
#include "tests/support/simulation/run_clock.hpp"

namespace hil::io::modbus::bench {

using Bytes = std::vector<std::uint8_t>;
using std::chrono::milliseconds;

/// "r7"
std::string numbered(const char* letter, std::size_t number);

RegisterEntry entry(std::string name, Table table, std::uint16_t address, ValueType type, bool writable);

/// Asks again every millisecond until `holds` or the limit is over; returns the last answer.
bool eventually(const std::function<bool()>& holds, milliseconds limit = milliseconds(5000));

std::vector<Sample> latched(Device& device);

/// A blocking client socket, every operation bounded by 5 s.
class RawClient {
 public:
  explicit RawClient(std::uint16_t port);
  void send(const Bytes& bytes);
  /// The next complete frame; empty when the peer closed, or nothing arrived in time.
  Bytes receive_frame(milliseconds limit = milliseconds(5000));
  /// True when the peer closes the connection within the limit. Reads and discards what arrives before.
  bool closed_within(milliseconds limit);
  int fd() const { return socket_.get(); }

 private:
  Descriptor socket_;
};

/// Transaction id, unit 1, and the protocol data unit.
Bytes frame(std::uint16_t transaction, const Bytes& pdu);

/// A connection as the fake server sees it.
class FakeConnection {
 public:
  explicit FakeConnection(Descriptor socket) : socket_(std::move(socket)) {}
  /// Empty when the client closed, or sent nothing for 5 s.
  Bytes receive();
  void send(const Bytes& bytes);
  /// The sound reply to a request: echoes of writes, reads answered with `value` in every register.
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

struct CommandResult {
  int exit_code = -1;
  std::string output;  ///< stdout and stderr
};
CommandResult run_command(const std::string& command);

/// A child process whose first line of output is waited for; killed at the end.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command);
  ~Process();
  const std::string& first_line() const { return first_line_; }
  /// The number after the last ':' of the first line.
  std::uint16_t port() const;
  void kill();
  /// SIGTERM, and the exit code.
  int terminate();

 private:
  int pid_ = -1;
  Descriptor output_;
  std::string first_line_;
};

}  // namespace hil::io::modbus::bench
