#pragma once
// One Modbus TCP connection of a client, over libmodbus.
//
// What libmodbus 3.1.6 does and what is done here instead:
// - It compares the transaction id of a reply with the request's, but after a time-out leaves the late reply
//   in the socket, so that every later answer would be off by one. Here a connection that timed out or said anything
//   unexpected is closed, and before each request the socket must be empty: bytes nobody asked for close it
//   too. No reply can be taken for the answer to another request.
// - It ignores the length in a reply's header. Bytes beyond the parsed reply are found by the same test.
// - Its byte time-out (500 ms between two bytes) would let a slow server hold a request for minutes. It is
//   off; the response time-out then bounds the whole reply, to the microsecond.
// - It does not compare unit identifiers in replies, and never shows a reply's header. Neither is it done here: its
//   raw requests would show it, but they all carry transaction id 0, and that check is worth more. One
//   connection serves one unit.
//
// Threads: one at a time.

#include <modbus/modbus.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "io/modbus/register_map.hpp"
#include "io/modbus/tcp_endpoint.hpp"

namespace hil::io::modbus {

enum class Reply : std::uint8_t {
  good,
  exception,  ///< the unit refused this request; the connection is fine
  timeout,    ///< no whole reply within the limit; the connection was closed
  broken,     ///< closed by the other side, or a reply that is none; the connection was closed
};

class ClientSession {
 public:
  /// `unit`: the unit identifier in every request, 0..247 or 255. Misuse (asserts): another number.
  explicit ClientSession(std::uint8_t unit);

  bool connected() const noexcept { return socket_.open(); }
  /// Takes over a connected, non-blocking socket.
  void adopt(Descriptor socket);
  void disconnect() noexcept;

  /// False, and closed: the other side closed the connection or sent bytes that nobody asked for. Asked by
  /// every request too.
  bool usable();

  /// Reads `registers.size()` addresses. On anything but `good`, `registers` is undefined. Blocks for `limit`
  /// at most.
  Reply read(Table table, std::uint16_t address, std::span<std::uint16_t> registers,
             std::chrono::microseconds limit);
  /// Writes coils or holding registers: function 5 or 6 for one, 15 or 16 for more. Blocks for `limit` at
  /// most.
  Reply write(Table table, std::uint16_t address, std::span<const std::uint16_t> registers,
              std::chrono::microseconds limit);

  /// After anything but `good`: what happened, as the end of a sentence ("illegal data address (exception
  /// 2)").
  const std::string& fault() const noexcept { return fault_; }

 private:
  struct FreeContext {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };

  bool prepare(std::chrono::microseconds limit);
  Reply outcome_of(int rc, int wanted, std::chrono::microseconds limit);
  Reply close_with(Reply reply, std::string fault);

  std::unique_ptr<modbus_t, FreeContext> context_;
  Descriptor socket_;
  std::string fault_;
};

}  // namespace hil::io::modbus
