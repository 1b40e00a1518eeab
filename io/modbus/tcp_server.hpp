#pragma once
// A Modbus TCP server without a thread: one call of serve() waits for sockets and answers what arrived.
// Frames are gathered here, without ever waiting for a client, and checked (request_check.hpp) before
// modbus_reply of libmodbus answers them.
//
// Against bad clients: at most `max_connections`. One more takes the place of the client that has sent
// nothing for the longest time, if that is at least `replaceable_after`, and is refused (closed at once)
// otherwise. A client that sends no whole request for `idle_limit` is dropped; so is one whose request is not
// whole `frame_limit` after its first byte, one that sends bytes that are no Modbus TCP, and one that does
// not take its replies. A write that would leave a register outside its range is answered with exception 3
// and changes nothing. The server answers every unit identifier and repeats it in the reply.
//
// Threads: one at a time; counters() and clients() from any thread.

#include <modbus/modbus.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <string>
#include <vector>

#include "io/modbus/exception_counts.hpp"
#include "io/modbus/register_bank.hpp"
#include "io/modbus/request_check.hpp"
#include "io/modbus/tcp_endpoint.hpp"

namespace hil::io::modbus {

struct ServerLimits {
  std::size_t max_connections = 64;
  std::chrono::milliseconds replaceable_after{1'000};
  std::chrono::milliseconds idle_limit{60'000};
  std::chrono::milliseconds frame_limit{2'000};
};

/// All since construction.
struct ServerCounters {
  std::uint64_t requests = 0;    ///< whole frames
  std::uint64_t replies = 0;     ///< sent; exceptions among them
  std::uint64_t exceptions = 0;  ///< requests answered with an exception
  ExceptionCounts by_code{};     ///< the same, by code
  std::uint64_t malformed = 0;   ///< connections closed for bytes that are no Modbus TCP
  std::uint64_t accepted = 0;    ///< connections
  /// Connections beyond max_connections, or that the system had no descriptor for.
  std::uint64_t refused = 0;
  std::uint64_t replaced = 0;        ///< idle connections closed in favour of a new one
  std::uint64_t dropped_silent = 0;  ///< connections closed by idle_limit or frame_limit
  std::uint64_t dropped_deaf = 0;    ///< connections closed because a reply could not be sent
};

class TcpServer {
 public:
  struct Hooks {
    std::function<void()>
        before_request;  ///< a sound request is about to be answered: bring the bank up to date
    std::function<void(const WrittenRange&)>
        after_write;  ///< a client's values are in the bank, the reply is not sent
    std::function<void(const RegisterBank::OutOfRange&)>
        on_refused_write;  ///< a client's value is outside its range: the bank is as before
  };

  /// `bank` outlives the server. Misuse (asserts): limits that are not positive.
  TcpServer(RegisterBank& bank, ServerLimits limits, Hooks hooks);

  /// Throws io::DeviceError; `who` names the server in it.
  void listen(const Endpoint& endpoint, const std::string& who);
  /// 0 while not listening.
  std::uint16_t port() const noexcept { return port_; }

  /// Waits up to `limit` (negative: for ever) for anything to do, and does it. Returns early when `wake_fd`
  /// (-1: none) can be read, which it leaves to the caller. Returns whether anything arrived.
  bool serve(std::chrono::milliseconds limit, int wake_fd);

  /// Closes all connections and the listening socket.
  void close() noexcept;

  std::size_t clients() const noexcept { return clients_.load(std::memory_order_relaxed); }
  ServerCounters counters() const noexcept;

 private:
  using Time = std::chrono::steady_clock::time_point;

  struct Connection {
    Descriptor socket;
    std::array<std::uint8_t, longest_frame> buffer{};
    std::size_t filled = 0;
    Time last_request;  ///< or the accept
    Time first_byte;    ///< of the frame being gathered; only when filled > 0
    bool closed = false;
  };
  struct FreeContext {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };
  struct AtomicCounters {
    std::atomic<std::uint64_t> requests{0}, replies{0}, malformed{0}, accepted{0}, refused{0}, replaced{0},
        dropped_silent{0}, dropped_deaf{0};
    ExceptionTally exceptions;
  };

  int poll_timeout(std::chrono::milliseconds limit, Time now) const;
  Time deadline_of(const Connection& connection) const noexcept;
  void accept_all(Time now);
  bool replace_idle(Time now);
  void receive(Connection& connection, Time now);
  void answer_whole_frames(Connection& connection, Time now);
  void answer(Connection& connection, std::span<const std::uint8_t> frame);
  /// Carries out the writes of a sound request. The exception to answer it with, or 0: none; after an
  /// exception the bank is as before.
  std::uint8_t write(std::span<const std::uint8_t> frame);
  bool send_exception(const Connection& connection, std::span<const std::uint8_t> frame, std::uint8_t code);
  void drop_expired(Time now);

  RegisterBank& bank_;
  const ServerLimits limits_;
  const Hooks hooks_;
  std::unique_ptr<modbus_t, FreeContext> context_;
  Descriptor listener_;
  std::uint16_t port_ = 0;
  Time accept_again_{};  ///< the system had no descriptor: not before this
  std::list<Connection> connections_;
  std::vector<pollfd> polled_;
  std::atomic<std::size_t> clients_{0};
  AtomicCounters counters_;
};

}  // namespace hil::io::modbus
