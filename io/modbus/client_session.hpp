#pragma once
// One Modbus TCP connection of a client.
//
// A reply is accepted when everything that the protocol makes the unit repeat equals the request:
// transaction, protocol 0, length, unit, function, and for a write the address and the value. (libmodbus
// 3.1.6 compares neither unit, length nor written value, only half of the protocol, and does not expose a
// reply's header.) A connection with a timeout or an unexpected byte is closed. Before each request the
// socket must be empty; unsolicited bytes close it too. So no reply can be taken for that of another request.
// The limit covers the complete reply.
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
#include "io/modbus/unit_faults.hpp"

namespace hil::io::modbus {

enum class Reply : std::uint8_t {
  good,
  exception,  ///< the unit refused this request; the connection is fine
  timeout,    ///< no complete reply within the limit; the connection was closed
  broken,     ///< closed by the unit, or an invalid reply; the connection was closed
};

class ClientSession {
 public:
  /// `unit`: the unit identifier in every request. The specification gives serial lines 1 to 247 and reserves
  /// 248 to 254; over TCP gateways and devices use every value.
  explicit ClientSession(std::uint8_t unit) : unit_(unit) {}

  bool connected() const noexcept { return socket_.open(); }
  /// Takes ownership of a connected, non-blocking socket.
  void adopt(Descriptor socket);
  void disconnect() noexcept;

  /// What faults do to the requests from now on. `waits`: real time passes as it would without a reply.
  void set_interference(const Interference& interference, bool waits) noexcept {
    interference_ = interference;
    waits_ = waits;
  }

  /// False: the unit closed the connection or sent unsolicited bytes, and the connection is closed. Every
  /// request checks this too.
  bool usable();

  /// Reads `registers.size()` addresses. Unless it returns `good`, `registers` is undefined. Blocks for at
  /// most `limit.left`.
  Reply read(Table table, std::uint16_t address, std::span<std::uint16_t> registers, const TimeLimit& limit);
  /// Writes coils or holding registers: function 5 or 6 for one, 15 or 16 for several. Blocks for at most
  /// `limit.left`.
  Reply write(Table table, std::uint16_t address, std::span<const std::uint16_t> registers,
              const TimeLimit& limit);

  /// After a result other than `good`: the reason, as the end of a sentence ("illegal data address (exception
  /// 2)").
  const std::string& fault() const noexcept { return fault_; }
  /// The code in the last reply that was an exception, 1 to 11; 0 before the first.
  std::uint8_t exception_code() const noexcept { return exception_code_; }

 private:
  static constexpr std::size_t max_frame_bytes = 260;  // MBAP header of 7, function, 252 bytes

  bool prepare();
  /// A delayed reply, after it was received.
  Reply delay_reply(std::chrono::steady_clock::time_point began);
  /// Completes the header of the request in request_, sends it and receives the reply into reply_: either
  /// `reply_bytes` from the function code on, or an exception.
  Reply exchange(std::size_t request_bytes, std::size_t reply_bytes, const TimeLimit& limit);
  Reply send_whole(std::size_t size, std::chrono::steady_clock::time_point until);
  Reply receive_up_to(std::size_t size, std::chrono::steady_clock::time_point until);
  Reply check_head(std::size_t reply_bytes);
  Reply does_not_fit(const std::string& what);
  Reply close_with(Reply reply, std::string fault);

  const std::uint8_t unit_;
  std::uint16_t transaction_ = 0;
  std::array<std::uint8_t, max_frame_bytes> request_{}, reply_{};
  std::size_t received_ = 0;  ///< bytes of reply_
  TimeLimit limit_;
  Interference interference_;
  bool waits_ = true;
  Descriptor socket_;
  std::string fault_;
  std::uint8_t exception_code_ = 0;
};

}  // namespace hil::io::modbus
