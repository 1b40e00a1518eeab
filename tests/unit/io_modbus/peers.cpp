#include "peers.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>

#include "io/modbus/request_check.hpp"

namespace hil::io::modbus::test {

namespace {

bool readable_within(int fd, milliseconds limit) {
  pollfd wanted{fd, POLLIN, 0};
  return ::poll(&wanted, 1, static_cast<int>(limit.count())) > 0;
}

/// Whole frame or empty.
Bytes read_frame(int fd, milliseconds limit) {
  const auto until = std::chrono::steady_clock::now() + limit;
  Bytes bytes;
  while (find_frame(bytes).framing == Framing::incomplete) {
    const auto left = std::chrono::duration_cast<milliseconds>(until - std::chrono::steady_clock::now());
    if (left.count() <= 0 || !readable_within(fd, left)) return {};
    std::uint8_t byte = 0;
    if (::recv(fd, &byte, 1, 0) != 1) return {};
    bytes.push_back(byte);
  }
  return bytes;
}

void send_all(int fd, const Bytes& bytes) {
  // A refused send shows in what the test receives next.
  [[maybe_unused]] const ssize_t sent = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

}  // namespace

RawClient::RawClient(std::uint16_t port) {
  Connection connection =
      connect_within(resolve({"127.0.0.1", port}), {milliseconds(5000), milliseconds(5000)});
  EXPECT_EQ(connection.fault, "");
  socket_ = std::move(connection.socket);
}

void RawClient::send(const Bytes& bytes) {
  send_all(socket_.get(), bytes);
}

Bytes RawClient::receive_frame(milliseconds limit) {
  return read_frame(socket_.get(), limit);
}

bool RawClient::closed_within(milliseconds limit) {
  const auto until = std::chrono::steady_clock::now() + limit;
  while (std::chrono::steady_clock::now() < until) {
    const auto left = std::chrono::ceil<milliseconds>(until - std::chrono::steady_clock::now());
    if (!readable_within(socket_.get(), left)) return false;
    std::array<std::uint8_t, 512> dropped{};
    const ssize_t got = ::recv(socket_.get(), dropped.data(), dropped.size(), 0);
    if (got == 0 || (got < 0 && errno != EAGAIN)) return true;
  }
  return false;
}

Bytes frame(std::uint16_t transaction, const Bytes& pdu) {
  const auto length = static_cast<std::uint16_t>(pdu.size() + 1);
  Bytes bytes;
  bytes.reserve(header_size + pdu.size());
  for (const unsigned word : {std::uint32_t{transaction}, 0U, std::uint32_t{length}}) {
    bytes.push_back(static_cast<std::uint8_t>(word >> 8U));
    bytes.push_back(static_cast<std::uint8_t>(word));
  }
  bytes.push_back(1);  // the unit
  for (const std::uint8_t byte : pdu)
    bytes.push_back(byte);
  return bytes;
}

Bytes FakeConnection::receive() {
  return read_frame(socket_.get(), milliseconds(5000));
}

void FakeConnection::send(const Bytes& bytes) {
  send_all(socket_.get(), bytes);
}

Bytes FakeConnection::reply_to(const Bytes& request, std::uint16_t value) {
  if (request.empty()) return {};
  const auto transaction = static_cast<std::uint16_t>(request[0] << 8U | request[1]);
  const std::uint8_t function = request[7];
  if (function > 4) {
    // Writes are echoed up to their count or value.
    return frame(transaction, Bytes(request.begin() + 7, request.begin() + 12));
  }
  const unsigned count = static_cast<unsigned>(request[10]) << 8U | request[11];
  Bytes pdu{function, static_cast<std::uint8_t>(2 * count)};
  for (unsigned i = 0; i < count; ++i) {
    pdu.push_back(static_cast<std::uint8_t>(value >> 8U));
    pdu.push_back(static_cast<std::uint8_t>(value));
  }
  return frame(transaction, pdu);
}

FakeServer::FakeServer(Script script)
    : listener_(listen_on({"127.0.0.1", 0}, "fake server")),
      port_(port_of(listener_)),
      script_(std::move(script)) {
  thread_ = std::thread([this] {
    while (!stop_.load()) {
      if (!readable_within(listener_.get(), milliseconds(10))) continue;
      Descriptor socket(::accept(listener_.get(), nullptr, nullptr));
      if (!socket.open()) continue;
      FakeConnection connection(std::move(socket));
      script_(connection, connections_.fetch_add(1));
    }
  });
}

FakeServer::~FakeServer() {
  stop_.store(true);
  thread_.join();
}

}  // namespace hil::io::modbus::test
