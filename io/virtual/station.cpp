#include "io/virtual/station.hpp"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <thread>

namespace hil::io::virtual_bus {

namespace {

std::int64_t wall_clock_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

bool may_come_later(int system_error) noexcept {
  return system_error == ENOENT || system_error == ECONNREFUSED || system_error == EAGAIN ||
         system_error == EINTR;
}

}  // namespace

void Station::open(const RunClock& clock, Pacing) {
  can::require(socket_ < 0, "a bus is opened once");
  clock_ = &clock;
  const auto refuse = [&](const std::string& reason) -> void {
    close();
    throw DeviceError(description() + " can not be reached: " + reason);
  };
  const auto path = unix_path_of(config_.address);
  sockaddr_un place{};
  if (!path || path->size() >= sizeof place.sun_path) {
    refuse("its address has to be unix:/path, with a path of at most 107 bytes");
  }
  place.sun_family = AF_UNIX;
  std::memcpy(place.sun_path, path->c_str(), path->size() + 1);
  const auto end = std::chrono::steady_clock::now() + std::chrono::nanoseconds(config_.connect_limit_ns);
  while (true) {
    socket_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
    if (socket_ < 0) refuse(std::strerror(errno));
    if (::connect(socket_, reinterpret_cast<const sockaddr*>(&place), sizeof place) == 0) break;
    const int error = errno;
    ::close(socket_);
    socket_ = -1;
    if (!may_come_later(error) || std::chrono::steady_clock::now() >= end) {
      refuse(std::string(std::strerror(error)) + "; is the run that owns this bus going on?");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  const HelloPacket hello = hello_from(config_.name);
  if (::send(socket_, &hello, sizeof hello, MSG_NOSIGNAL) != static_cast<ssize_t>(sizeof hello)) {
    refuse(std::strerror(errno));
  }
}

void Station::close() noexcept {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

can::SendResult Station::send(const can::Frame& frame) noexcept {
  if (socket_ < 0 || lost_ || !can::valid_length(frame.raw.len, frame.is_fd)) return can::SendResult::error;
  const int flags = MSG_NOSIGNAL | (lockstep_ ? 0 : MSG_DONTWAIT);
  const auto size = static_cast<ssize_t>(frame.struct_size());
  while (::send(socket_, &frame.raw, frame.struct_size(), flags) != size) {
    if (errno == EINTR) continue;
    if (errno == EAGAIN || errno == ENOBUFS) return can::SendResult::no_buffer;
    lose(std::strerror(errno));
    return can::SendResult::error;
  }
  return can::SendResult::sent;
}

can::ReceiveResult Station::receive(can::Frame& frame) noexcept {
  while (socket_ >= 0 && !lost_) {
    PacketBuffer packet{};
    const ssize_t size = ::recv(socket_, packet.data(), packet.size(), MSG_DONTWAIT);
    if (size < 0 && errno == EINTR) continue;
    if (size < 0 && errno == EAGAIN) return can::ReceiveResult::empty;
    if (size == 0 || (size < 0 && errno == ECONNRESET)) return lose("the hub has closed it");
    if (size < 0) return lose(std::strerror(errno));
    const auto length = static_cast<std::size_t>(size);
    if (const auto received = frame_of(packet, length)) {
      if (!filters_.passes(received->raw.can_id)) continue;
      frame = *received;
      frame.direction = can::Direction::rx;
      frame.time_ns = now_ns();
      frame.wall_ns = lockstep_ ? lockstep_now_ns_ : wall_clock_ns();
      return can::ReceiveResult::frame;
    }
    if (const auto time = time_packet_of(packet, length)) {
      take_time(*time);
    } else {
      malformed_.fetch_add(1, std::memory_order_relaxed);
    }
  }
  return lost_ ? can::ReceiveResult::lost : can::ReceiveResult::empty;
}

// The socket keeps the order of packets. When the barrier has been read, every frame before it has been
// returned to the application; and since the application has called receive() again, it has sent its replies.
void Station::take_time(const TimePacket& packet) noexcept {
  lockstep_ = true;
  lockstep_now_ns_ = packet.run_time_ns;
  if (packet.kind != TimePacket::Kind::barrier) return;
  TimePacket answer = packet;
  answer.kind = TimePacket::Kind::ack;
  while (::send(socket_, &answer, sizeof answer, MSG_NOSIGNAL) < 0 && errno == EINTR) {
  }
}

can::ReceiveResult Station::lose(const char* reason) noexcept {
  lost_ = true;
  const std::lock_guard lock(fault_mutex_);
  fault_ = description() + " is lost: " + reason;
  return can::ReceiveResult::lost;
}

can::ExchangeResult Station::exchange(RunTimeNs) {
  can::require(false, "only the hub of a virtual bus exchanges");
  return {};
}

can::BusCounters Station::counters() const noexcept {
  return {0, malformed_.load(std::memory_order_relaxed), 0, {}};
}

std::string Station::fault() const {
  const std::lock_guard lock(fault_mutex_);
  return fault_;
}

}  // namespace hil::io::virtual_bus
