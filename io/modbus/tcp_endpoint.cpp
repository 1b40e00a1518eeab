#include "io/modbus/tcp_endpoint.hpp"

#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <system_error>
#include <utility>

#include "io/device.hpp"

namespace hil::io::modbus {

namespace {

std::string words_of(int error) {
  return std::generic_category().message(error);
}

std::string advice_for(int error, const Endpoint& endpoint) {
  if (error == EADDRINUSE)
    return "; another program uses that port: stop it, or choose another port (auto in a scenario: a free "
           "one)";
  if (error == EACCES) {
    return "; ports below 1024 need a privilege (CAP_NET_BIND_SERVICE): choose a port from 1024 on";
  }
  if (error == EADDRNOTAVAIL)
    return "; no network interface of this machine has the address " + endpoint.host;
  return "";
}

std::int64_t milliseconds_left(std::chrono::steady_clock::time_point until) {
  const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - std::chrono::steady_clock::now());
  return left.count() > 0 ? left.count() : 0;
}

/// Returns 0 when the pending connect succeeded, otherwise an errno; ETIMEDOUT when it is still pending at
/// `until`.
int finish_connect(int fd, std::chrono::steady_clock::time_point until) {
  while (true) {
    pollfd wanted{fd, POLLOUT, 0};
    const int ready = ::poll(&wanted, 1, static_cast<int>(milliseconds_left(until)));
    if (ready < 0 && errno == EINTR) continue;
    if (ready < 0) return errno;
    if (ready == 0) return ETIMEDOUT;
    int error = 0;
    socklen_t size = sizeof(error);
    if (::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) != 0) return errno;
    return error;
  }
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  if (this != &other) {
    reset();
    fd_ = other.release();
  }
  return *this;
}

Descriptor::~Descriptor() {
  reset();
}

int Descriptor::release() noexcept {
  return std::exchange(fd_, -1);
}

void Descriptor::reset() noexcept {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

std::optional<HostAndPort> split_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos) return std::nullopt;
  std::string host = text.substr(0, colon);
  const bool in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  if (in_brackets) host = host.substr(1, host.size() - 2);
  if (host.empty() || colon + 1 == text.size() || (!in_brackets && host.find(':') != std::string::npos))
    return std::nullopt;
  return HostAndPort{std::move(host), text.substr(colon + 1)};
}

std::optional<Endpoint> parse_endpoint(const std::string& text) {
  const auto parts = split_address(text);
  if (!parts) return std::nullopt;
  std::uint16_t port = 0;
  const char* const end = parts->port.data() + parts->port.size();
  const auto [rest, error] = std::from_chars(parts->port.data(), end, port);
  if (rest != end || error != std::errc()) return std::nullopt;
  return Endpoint{parts->host, port};
}

std::string Endpoint::to_text() const {
  const bool bare_v6 = host.find(':') != std::string::npos;
  return (bare_v6 ? "[" + host + "]" : host) + ":" + std::to_string(port);
}

SocketAddress resolve(const Endpoint& endpoint) {
  addrinfo hints{};
  hints.ai_family = AF_UNSPEC;
  hints.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int rc = ::getaddrinfo(endpoint.host.c_str(), std::to_string(endpoint.port).c_str(), &hints, &found);
  if (rc != 0 || found == nullptr) {
    throw DeviceError("the Modbus address " + endpoint.to_text() + " can not be resolved: " +
                      ::gai_strerror(rc) + "; write an IP address, or a name that this machine can look up");
  }
  SocketAddress address;
  std::memcpy(&address.storage, found->ai_addr, found->ai_addrlen);
  address.size = found->ai_addrlen;
  ::freeaddrinfo(found);
  return address;
}

std::string in_milliseconds(std::chrono::microseconds limit) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g ms", static_cast<double>(limit.count()) * 1e-3);
  return text.data();
}

Connection connect_within(const SocketAddress& address, const TimeLimit& limit) {
  const auto until = std::chrono::steady_clock::now() + limit.left;
  Descriptor socket(::socket(address.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  if (!socket.open()) return {Descriptor(), words_of(errno)};
  const int on = 1;
  ::setsockopt(socket.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  int error = 0;
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&address.storage), address.size) != 0) {
    error = errno == EINPROGRESS ? finish_connect(socket.get(), until) : errno;
  }
  if (error == ETIMEDOUT) return {Descriptor(), "no answer within " + in_milliseconds(limit.length)};
  if (error != 0) return {Descriptor(), words_of(error)};
  return {std::move(socket), ""};
}

Descriptor listen_on(const Endpoint& endpoint, const std::string& subject) {
  const SocketAddress address = resolve(endpoint);
  Descriptor socket(::socket(address.storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  int error = socket.open() ? 0 : errno;
  const int on = 1;
  // Allows a port that is in TIME_WAIT after an earlier run; a port that another socket listens on is still
  // refused.
  if (error == 0 && ::setsockopt(socket.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) != 0) error = errno;
  if (error == 0 &&
      ::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address.storage), address.size) != 0) {
    error = errno;
  }
  if (error == 0 && ::listen(socket.get(), SOMAXCONN) != 0) error = errno;
  if (error != 0) {
    throw DeviceError(subject + " can not listen on " + endpoint.to_text() + ": " + words_of(error) +
                      advice_for(error, endpoint));
  }
  return socket;
}

std::uint16_t port_of(const Descriptor& socket) {
  sockaddr_storage storage{};
  socklen_t size = sizeof(storage);
  if (::getsockname(socket.get(), reinterpret_cast<sockaddr*>(&storage), &size) != 0) return 0;
  if (storage.ss_family == AF_INET6) return ntohs(reinterpret_cast<const sockaddr_in6&>(storage).sin6_port);
  return ntohs(reinterpret_cast<const sockaddr_in&>(storage).sin_port);
}

}  // namespace hil::io::modbus
