#pragma once
// A Modbus TCP server without a thread: each call of serve() waits for sockets and answers what has arrived.
// The server collects and checks frames (request_check.hpp) without waiting for a client, before modbus_reply
// of libmodbus answers them.
//
// Protection against bad clients: there are at most `max_connections`. A further client replaces the client
// that has sent nothing for the longest time, if that is at least `replaceable_after`, and is otherwise
// refused (closed at once). The server closes the connection of a client that sends no complete request for
// `idle_limit`, whose request is not complete `frame_limit` after its first byte, that sends bytes that are
// not Modbus TCP, or that does not read its replies. A write that would leave a register outside its range is
// answered with exception 3 and changes nothing. The server answers every unit identifier and repeats it in
// the reply. While a fault delays a reply, the server reads nothing from its client and applies no time limit
// to it.
//
// Threads: one at a time; any thread may call counters() and clients().

#include <modbus/modbus.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "io/modbus/exception_tally.hpp"
#include "io/modbus/register_bank.hpp"
#include "io/modbus/request_check.hpp"
#include "io/modbus/tcp_endpoint.hpp"
#include "io/modbus/unit_faults.hpp"

namespace hil::io::modbus {

struct ServerLimits {
  std::size_t max_connections = 64;
  std::chrono::milliseconds replaceable_after{1'000};
  std::chrono::milliseconds idle_limit{60'000};
  std::chrono::milliseconds frame_limit{2'000};
};

/// Counted since construction.
struct ServerCounters {
  std::uint64_t requests = 0;    ///< complete frames
  std::uint64_t replies = 0;     ///< sent, including exceptions
  std::uint64_t exceptions = 0;  ///< requests answered with an exception
  ExceptionCounts by_code{};     ///< the exceptions by code
  FirstRefusedRequests first_refused{};
  std::uint64_t malformed = 0;  ///< connections closed because of bytes that are not Modbus TCP
  std::uint64_t accepted = 0;   ///< connections
  /// Connections beyond max_connections, or for which the system had no descriptor.
  std::uint64_t refused = 0;
  std::uint64_t replaced = 0;             ///< idle connections closed in favour of a new one
  std::uint64_t dropped_silent = 0;       ///< connections closed by idle_limit or frame_limit
  std::uint64_t dropped_not_reading = 0;  ///< connections closed because a reply could not be sent
};

class TcpServer {
 public:
  /// Called on the thread of serve().
  struct Hooks {
    std::function<void()> before_request;  ///< before a valid request is answered: updates the bank
    std::function<void(const RequestRange&)>
        after_write;  ///< after a client's values are in the bank, before the reply is sent
    std::function<void(const RegisterBank::OutOfRange&)>
        on_refused_write;  ///< after a client's value was outside its range; the bank is unchanged
    std::function<Interference()> interference{};  ///< of faults with requests and connections
    std::function<void()> on_frame{};              ///< for each complete frame
    std::function<void()> on_cut{};                ///< a fault closes the connections of clients
    std::function<RunTimeNs()> run_time{};         ///< clock of delays; empty: replies are never delayed
    std::function<void()> on_delay{};              ///< the delay of a reply begins
  };

  /// `bank` outlives the server. Misuse (asserts): limits that are not positive.
  TcpServer(RegisterBank& bank, ServerLimits limits, Hooks hooks);

  /// Throws io::DeviceError, whose message begins with `subject`.
  void listen(const Endpoint& endpoint, const std::string& subject);
  /// 0 while not listening.
  std::uint16_t port() const noexcept { return port_; }

  /// Waits for work for at most `limit` (negative: without limit), and does it. Returns early when `wake_fd`
  /// (-1: none) becomes readable; the caller reads it. Returns whether anything arrived.
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
    Time last_request;  ///< time of the last request, or of the accept
    Time first_byte;    ///< of the frame being received; only if filled > 0
    /// When the request in the buffer is answered, which a fault delays; empty: at once.
    std::optional<RunTimeNs> reply_due_ns{};
    bool closed = false;
  };
  struct FreeContext {
    void operator()(modbus_t* context) const noexcept { modbus_free(context); }
  };
  struct AtomicCounters {
    std::atomic<std::uint64_t> requests{0}, replies{0}, malformed{0}, accepted{0}, refused{0}, replaced{0},
        dropped_silent{0}, dropped_not_reading{0};
    ExceptionTally exceptions;
  };

  int poll_timeout(std::chrono::milliseconds limit, Time now) const;
  Time deadline_of(const Connection& connection) const noexcept;
  void accept_all(Time now);
  bool replace_idle(Time now);
  void receive(Connection& connection, Time now);
  void answer_whole_frames(Connection& connection, Time now);
  /// Begins or ends the delay of the reply to the first request in the buffer. Whether the reply is delayed.
  bool delay_reply(Connection& connection);
  void answer(Connection& connection, std::span<const std::uint8_t> frame);
  /// Applies the writes of a valid request. Returns the exception to answer with, or 0; the bank is unchanged
  /// after an exception.
  std::uint8_t write(std::span<const std::uint8_t> frame);
  bool send_exception(const Connection& connection, std::span<const std::uint8_t> frame, std::uint8_t code);
  void drop_expired(Time now);

  RegisterBank& bank_;
  const ServerLimits limits_;
  const Hooks hooks_;
  std::unique_ptr<modbus_t, FreeContext> context_;
  Descriptor listener_;
  std::uint16_t port_ = 0;
  Time accept_again_{};  ///< the system had no descriptor: accept not before this time
  std::list<Connection> connections_;
  std::vector<pollfd> polled_;
  std::atomic<std::size_t> clients_{0};
  AtomicCounters counters_;
};

}  // namespace hil::io::modbus
