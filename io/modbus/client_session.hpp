#pragma once
// One Modbus TCP connection of a client.
//
// A reply counts when everything in it that the protocol lets the other side repeat is what was asked: transaction,
// protocol 0, length, unit, function, and of a write the address and the value. (libmodbus 3.1.6 compares neither unit,
// length nor written value, a protocol only by half, and never shows a reply's header.) A connection that timed out or
// said anything unexpected is closed, and before each request the socket must be empty: bytes that nobody asked for
// close it too. So no reply can be taken for the answer to another request. The limit bounds the whole reply, however
// its bytes trickle in.
//
// Threads: one at a time.

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
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
  /// `unit`: the unit identifier in every request. The specification gives serial lines 1 to 247 and reserves
  /// 248 to 254; over TCP gateways and devices use every value.
  explicit ClientSession(std::uint8_t unit) : unit_(unit) {}

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
  /// The code in the last reply that was an exception, 1 to 11; 0 before the first.
  std::uint8_t exception_code() const noexcept { return exception_code_; }

 private:
  static constexpr std::size_t max_frame_bytes = 260;  // MBAP header of 7, function, 252 bytes

  bool prepare();
  /// Sends the request that stands in request_ behind the room for its header, and takes the reply into reply_: either
  /// `reply_bytes` from the function code on, or an exception.
  Reply exchange(std::size_t request_bytes, std::size_t reply_bytes, std::chrono::microseconds limit);
  Reply send_whole(std::size_t size, std::chrono::steady_clock::time_point until);
  Reply receive_up_to(std::size_t size, std::chrono::steady_clock::time_point until);
  Reply check_head(std::size_t reply_bytes);
  Reply does_not_fit(const std::string& what);
  Reply close_with(Reply reply, std::string fault);

  const std::uint8_t unit_;
  std::uint16_t transaction_ = 0;
  std::array<std::uint8_t, max_frame_bytes> request_{}, reply_{};
  std::size_t received_ = 0;  ///< of reply_
  std::chrono::microseconds limit_{0};
  Descriptor socket_;
  std::string fault_;
  std::uint8_t exception_code_ = 0;
};

}  // namespace hil::io::modbus
