#pragma once
// Sockets for Modbus TCP: resolving, connecting within a limit, listening.
//
// Threads: free functions, callable from any thread. They block as stated.

#include <sys/socket.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace hil::io::modbus {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) noexcept : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.release()) {}
  Descriptor& operator=(Descriptor&& other) noexcept;
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor();

  int get() const noexcept { return fd_; }
  bool open() const noexcept { return fd_ >= 0; }
  int release() noexcept;
  void reset() noexcept;

 private:
  int fd_ = -1;
};

/// Splits "HOST:PORT", with an IPv6 address in brackets, as Endpoint::to_text writes it: "[::1]:502" is ::1
/// and 502. Empty when a part is missing, or when an IPv6 address without brackets makes the port ambiguous.
/// Does not check the parts.
struct HostAndPort {
  std::string host;
  std::string port;
};
std::optional<HostAndPort> split_address(const std::string& text);

struct Endpoint {
  std::string host = "127.0.0.1";  ///< a name, an IPv4 or an IPv6 address
  std::uint16_t port = 502;

  std::string to_text() const;
};

/// "127.0.0.1:1502", "[::1]:0". Empty when there is no port from 0 to 65535; does not check the host.
std::optional<Endpoint> parse_endpoint(const std::string& text);

/// A resolved endpoint.
struct SocketAddress {
  sockaddr_storage storage{};
  socklen_t size = 0;
};

/// The first address that the system resolves for the endpoint. May block in the resolver. Throws
/// io::DeviceError.
SocketAddress resolve(const Endpoint& endpoint);

/// The result of an attempt to connect; `fault` is empty exactly when `socket` is open.
struct Connection {
  Descriptor socket;
  std::string fault;  ///< the system's error text, or "no answer within 200 ms"
};

/// "200 ms", "0.5 ms"
std::string in_milliseconds(std::chrono::microseconds limit);

/// A time-out of which a part may have passed.
struct TimeLimit {
  std::chrono::microseconds left{0};
  std::chrono::microseconds length{0};  ///< of the whole time-out, which messages name
};

/// Connects without Nagle's delay (TCP_NODELAY) and non-blocking. Blocks for at most `limit.left`.
Connection connect_within(const SocketAddress& address, const TimeLimit& limit);

/// A listening, non-blocking socket. Port 0: the system chooses one, see port_of. Throws io::DeviceError with
/// `subject`, the endpoint, the system's error and what to do.
Descriptor listen_on(const Endpoint& endpoint, const std::string& subject);

/// The local port of a bound socket.
std::uint16_t port_of(const Descriptor& socket);

}  // namespace hil::io::modbus
