#include "io/modbus/tcp_server.hpp"

#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <new>
#include <numeric>
#include <optional>
#include <utility>

#include "io/modbus/request_plan.hpp"
#include "io/modbus/require.hpp"

namespace hil::io::modbus {

namespace {

constexpr auto relaxed = std::memory_order_relaxed;
constexpr std::chrono::milliseconds accept_pause{100};
constexpr int buffers_per_round = 8;

}  // namespace

TcpServer::TcpServer(RegisterBank& bank, ServerLimits limits, Hooks hooks)
    : bank_(bank),
      limits_(limits),
      hooks_(std::move(hooks)),
      context_(modbus_new_tcp_pi("127.0.0.1", "502")) {
  if (context_ == nullptr) throw std::bad_alloc();
  require(limits_.max_connections > 0 && limits_.replaceable_after.count() > 0 &&
              limits_.idle_limit.count() > 0 && limits_.frame_limit.count() > 0,
          "TcpServer: a limit is not positive");
}

void TcpServer::listen(const Endpoint& endpoint, const std::string& subject) {
  listener_ = listen_on(endpoint, subject);
  port_ = port_of(listener_);
}

void TcpServer::close() noexcept {
  connections_.clear();
  clients_.store(0, relaxed);
  listener_.reset();
  port_ = 0;
}

bool TcpServer::serve(std::chrono::milliseconds limit, int wake_fd) {
  Time now = std::chrono::steady_clock::now();
  const bool accepting = listener_.open() && now >= accept_again_;
  polled_.clear();
  polled_.push_back({accepting ? listener_.get() : -1, POLLIN, 0});
  polled_.push_back({wake_fd, POLLIN, 0});
  for (const Connection& connection : connections_)
    polled_.push_back({connection.reply_due_ns ? -1 : connection.socket.get(), POLLIN, 0});
  const int ready = ::poll(polled_.data(), polled_.size(), poll_timeout(limit, now));
  now = std::chrono::steady_clock::now();
  std::size_t index = 2;
  for (Connection& connection : connections_) {
    if (connection.reply_due_ns)
      answer_whole_frames(connection, now);
    else if (ready > 0 && polled_[index].revents != 0)
      receive(connection, now);
    ++index;
  }
  drop_expired(now);
  const bool is_disconnected = hooks_.interference && hooks_.interference().is_disconnected;
  bool is_cut = false;
  const auto cut_connections = [&] {
    is_cut |= !connections_.empty();
    connections_.clear();
  };
  if (is_disconnected) cut_connections();
  connections_.remove_if([](const Connection& connection) { return connection.closed; });
  if (ready > 0 && polled_[0].revents != 0) accept_all(now);
  if (is_disconnected) cut_connections();
  if (is_cut && hooks_.on_cut) hooks_.on_cut();
  clients_.store(connections_.size(), relaxed);
  return ready > 0;
}

TcpServer::Time TcpServer::deadline_of(const Connection& connection) const noexcept {
  if (connection.reply_due_ns) return Time::max();
  const Time idle = connection.last_request + limits_.idle_limit;
  return connection.filled == 0 ? idle : std::min(idle, connection.first_byte + limits_.frame_limit);
}

int TcpServer::poll_timeout(std::chrono::milliseconds limit, Time now) const {
  Time until = limit.count() < 0 ? Time::max() : now + limit;
  for (const Connection& connection : connections_) {
    until = std::min(until, deadline_of(connection));
    if (!connection.reply_due_ns) continue;
    const std::chrono::nanoseconds left(*connection.reply_due_ns - hooks_.run_time());
    until = std::min(until, now + std::max(left, std::chrono::nanoseconds(0)));
  }
  if (listener_.open() && accept_again_ > now) until = std::min(until, accept_again_);
  if (until == Time::max()) return -1;
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - now).count();
  return static_cast<int>(std::clamp<std::int64_t>(left, 0, std::numeric_limits<int>::max()));
}

void TcpServer::accept_all(Time now) {
  // Accepts at most as many connections as there are places; places of connections that clients have closed
  // are freed in the next round. If no place is free, a new connection replaces an idle one or is refused.
  const std::size_t places = limits_.max_connections - connections_.size();
  const std::size_t most = places > 0 ? places : SOMAXCONN;
  for (std::size_t i = 0; i < most; ++i) {
    Descriptor socket(::accept4(listener_.get(), nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC));
    if (!socket.open()) {
      if (errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM) {
        counters_.refused.fetch_add(1, relaxed);
        accept_again_ = now + accept_pause;
      }
      return;
    }
    if (places == 0 && !replace_idle(now)) {
      counters_.refused.fetch_add(1, relaxed);
      continue;
    }
    const int on = 1;
    ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    Connection& connection = connections_.emplace_back();
    connection.socket = std::move(socket);
    connection.last_request = now;
    counters_.accepted.fetch_add(1, relaxed);
  }
}

/// Closes the connection that has been idle the longest. False: none has been idle for `replaceable_after`.
bool TcpServer::replace_idle(Time now) {
  const auto idle = std::min_element(
      connections_.begin(), connections_.end(),
      [](const Connection& a, const Connection& b) { return a.last_request < b.last_request; });
  if (idle == connections_.end() || now - idle->last_request < limits_.replaceable_after) return false;
  connections_.erase(idle);
  counters_.replaced.fetch_add(1, relaxed);
  return true;
}

void TcpServer::receive(Connection& connection, Time now) {
  // Reads several buffers, so that a client that sent data and closed is detected in this round; but not
  // without limit, so that one busy client does not delay the others.
  for (int i = 0; i < buffers_per_round && !connection.closed && !connection.reply_due_ns; ++i) {
    const ssize_t got = ::recv(connection.socket.get(), connection.buffer.data() + connection.filled,
                               connection.buffer.size() - connection.filled, 0);
    if (got <= 0) {
      const bool nothing_yet = got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR);
      connection.closed = !nothing_yet;
      return;
    }
    if (connection.filled == 0) connection.first_byte = now;
    connection.filled += static_cast<std::size_t>(got);
    answer_whole_frames(connection, now);
  }
}

void TcpServer::answer_whole_frames(Connection& connection, Time now) {
  std::span<const std::uint8_t> rest = std::span(connection.buffer).first(connection.filled);
  while (!connection.closed && !rest.empty()) {
    const FramingResult found = find_frame(rest);
    if (found.framing == Framing::incomplete) break;
    if (found.framing == Framing::invalid) {
      counters_.malformed.fetch_add(1, relaxed);
      connection.closed = true;
      break;
    }
    if (delay_reply(connection)) break;
    answer(connection, rest.first(found.size));
    connection.last_request = now;
    connection.first_byte = now;
    rest = rest.subspan(found.size);
  }
  std::copy(rest.begin(), rest.end(), connection.buffer.begin());
  connection.filled = rest.size();
}

/// If the fault ends before the delay has passed, the reply is sent at once.
bool TcpServer::delay_reply(Connection& connection) {
  if (!hooks_.interference || !hooks_.run_time) return false;
  const std::chrono::nanoseconds delay = hooks_.interference().delay;
  if (delay.count() > 0 && !connection.reply_due_ns) {
    connection.reply_due_ns = hooks_.run_time() + delay.count();
    if (hooks_.on_delay) hooks_.on_delay();
  }
  if (delay.count() > 0 && hooks_.run_time() < *connection.reply_due_ns) return true;
  connection.reply_due_ns.reset();
  return false;
}

void TcpServer::answer(Connection& connection, std::span<const std::uint8_t> frame) {
  counters_.requests.fetch_add(1, relaxed);
  const Interference interference = hooks_.interference ? hooks_.interference() : Interference{};
  if (hooks_.on_frame) hooks_.on_frame();
  if (interference.lets_no_reply_through()) return;
  std::uint8_t exception = check_request(frame, bank_);
  if (exception == 0) exception = interference.exception;
  if (exception == 0) {
    if (hooks_.before_request) hooks_.before_request();
    exception = write(frame);
  }
  bool sent = false;
  if (exception != 0) {
    counters_.exceptions.add(exception, requested_range(frame));
    sent = send_exception(connection, frame, exception);
  } else {
    // libmodbus may read the longest header of a request before it knows the function.
    std::array<std::uint8_t, longest_frame> request{};
    std::copy(frame.begin(), frame.end(), request.begin());
    modbus_set_socket(context_.get(), connection.socket.get());
    // Repeats the same writes, with the same effect, and sends the reply.
    sent = modbus_reply(context_.get(), request.data(), static_cast<int>(frame.size()), bank_.mapping()) >= 0;
    modbus_set_socket(context_.get(), -1);
  }
  if (sent) {
    counters_.replies.fetch_add(1, relaxed);
  } else {
    counters_.dropped_not_reading.fetch_add(1, relaxed);
    connection.closed = true;
  }
}

std::uint8_t TcpServer::write(std::span<const std::uint8_t> frame) {
  const std::optional<RequestRange> range = written_range(frame);
  if (!range) return 0;
  std::array<std::uint16_t, max_bits_written> before{};
  for (std::uint16_t i = 0; i < range->count; ++i)
    before[i] = bank_.get(range->table, static_cast<std::uint16_t>(range->address + i));
  apply_writes(frame, bank_);
  if (const auto refused = bank_.out_of_range(range->table, range->address, range->count)) {
    for (std::uint16_t i = 0; i < range->count; ++i)
      bank_.set(range->table, static_cast<std::uint16_t>(range->address + i), before[i]);
    if (hooks_.on_refused_write) hooks_.on_refused_write(*refused);
    return MODBUS_EXCEPTION_ILLEGAL_DATA_VALUE;
  }
  if (hooks_.after_write) hooks_.after_write(*range);
  return 0;
}

/// Replaces the exceptions of libmodbus 3.1.6: it adds 0x80 to the function, so that its refusal of function
/// 0x83 would be a valid reply to function 3, and it sleeps before some exceptions.
bool TcpServer::send_exception(const Connection& connection, std::span<const std::uint8_t> frame,
                               std::uint8_t code) {
  const auto function = static_cast<std::uint8_t>(frame[header_size] | 0x80U);
  const std::array<std::uint8_t, header_size + 2> reply{frame[0], frame[1], 0,        0,   0,
                                                        3,        frame[6], function, code};
  return ::send(connection.socket.get(), reply.data(), reply.size(), MSG_NOSIGNAL | MSG_DONTWAIT) ==
         static_cast<ssize_t>(reply.size());
}

void TcpServer::drop_expired(Time now) {
  for (Connection& connection : connections_) {
    if (connection.closed || now < deadline_of(connection)) continue;
    counters_.dropped_silent.fetch_add(1, relaxed);
    connection.closed = true;
  }
}

ServerCounters TcpServer::counters() const noexcept {
  ServerCounters counters;
  counters.requests = counters_.requests.load(relaxed);
  counters.replies = counters_.replies.load(relaxed);
  counters.by_code = counters_.exceptions.counts();
  counters.first_refused = counters_.exceptions.first_requests();
  counters.exceptions = std::accumulate(counters.by_code.begin(), counters.by_code.end(), std::uint64_t{0});
  counters.malformed = counters_.malformed.load(relaxed);
  counters.accepted = counters_.accepted.load(relaxed);
  counters.refused = counters_.refused.load(relaxed);
  counters.replaced = counters_.replaced.load(relaxed);
  counters.dropped_silent = counters_.dropped_silent.load(relaxed);
  counters.dropped_not_reading = counters_.dropped_not_reading.load(relaxed);
  return counters;
}

}  // namespace hil::io::modbus
