#include "io/can/socketcan_bus.hpp"

#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <limits>

namespace hil::io::can {

namespace {

constexpr std::int64_t look_period_ns = 20'000'000;

std::int64_t read_clock_ns(clockid_t clock) noexcept {
  timespec now{};
  ::clock_gettime(clock, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

struct Instant {
  ReceiveTime::Clocks clocks;
  RunTimeNs run_ns = 0;
};

/// Reads all clocks at nearly the same instant. The thread may lose its CPU between two readings, so the
/// closest of three attempts is used.
Instant read_clocks(const RunClock& run_clock) noexcept {
  constexpr std::int64_t close_enough_ns = 5'000;
  Instant best;
  std::int64_t best_width_ns = std::numeric_limits<std::int64_t>::max();
  for (int attempt = 0; attempt < 3 && best_width_ns > close_enough_ns; ++attempt) {
    const std::int64_t before_ns = read_clock_ns(CLOCK_MONOTONIC);
    const std::int64_t wall_ns = read_clock_ns(CLOCK_REALTIME);
    const RunTimeNs run_ns = run_clock.now_ns();
    const std::int64_t width_ns = read_clock_ns(CLOCK_MONOTONIC) - before_ns;
    if (width_ns >= best_width_ns) continue;
    best_width_ns = width_ns;
    best = {{before_ns + width_ns / 2, wall_ns}, run_ns};
  }
  return best;
}

template <typename Option>
bool set_option(int socket, int level, int name, const Option& value) noexcept {
  return ::setsockopt(socket, level, name, &value, sizeof value) == 0;
}

bool is_bus_gone(int system_error) noexcept {
  return system_error == ENETDOWN || system_error == ENODEV || system_error == ENXIO;
}

ifreq request_for(const std::string& interface) noexcept {
  ifreq request{};
  std::strncpy(request.ifr_name, interface.c_str(), IFNAMSIZ - 1);
  return request;
}

}  // namespace

void SocketCanBus::open(const RunClock& clock, Pacing pacing) {
  if (pacing == Pacing::lockstep) {
    throw DeviceError("CAN interface '" + config_.interface +
                      "' can not follow a virtual clock, it keeps wall-clock time; use the virtual bus, or "
                      "clock: realtime");
  }
  require(socket_ < 0, "a bus is opened once");
  clock_ = &clock;
  const std::string problem = try_open();
  if (!problem.empty()) throw DeviceError(problem);
}

std::string SocketCanBus::try_open() {
  const std::string bus = "CAN interface '" + config_.interface + "' ";
  if (config_.interface.empty() || config_.interface.size() >= IFNAMSIZ) {
    return bus + "can not exist: a name has 1 to 15 characters";
  }
  socket_ = ::socket(PF_CAN, SOCK_RAW | SOCK_NONBLOCK | SOCK_CLOEXEC, CAN_RAW);
  if (socket_ < 0) {
    const int error = errno;
    std::string text = bus + "can not be opened: socket(PF_CAN): " + std::strerror(error) + "; ";
    if (error == EPERM || error == EACCES) return text + "this process may not open CAN sockets";
    return text +
           "this kernel has no CAN: load it with 'modprobe can_raw', or use the virtual bus (device: "
           "virtual), or " +
           "run under tools/vcan-run";
  }
  receive_time_.socket_empty(read_clocks(*clock_).clocks);
  std::string problem = bind_to_interface();
  if (problem.empty()) problem = set_options();
  if (problem.empty()) problem = apply_filters();
  if (!problem.empty()) {
    ::close(socket_);
    socket_ = -1;
  }
  return problem;
}

std::string SocketCanBus::bind_to_interface() {
  const std::string bus = "CAN interface '" + config_.interface + "' ";
  ifreq request = request_for(config_.interface);
  if (::ioctl(socket_, SIOCGIFINDEX, &request) != 0) {
    return bus + "does not exist (" + std::strerror(errno) +
           "); a virtual one is made with 'ip link add dev " + config_.interface +
           " type vcan && ip link set " + config_.interface + " up'";
  }
  const int index = request.ifr_ifindex;
  if (!interface_is_up()) {
    return bus + "is down; bring it up with 'ip link set " + config_.interface +
           " up' (a real one needs its bit rate first: 'ip link set " + config_.interface +
           " type can bitrate 500000')";
  }
  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = index;
  if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    return bus + "can not be bound: " + std::strerror(errno) + "; is it a CAN interface?";
  }
  return {};
}

std::string SocketCanBus::set_options() {
  const int on = 1;
  const auto refused = [&](const char* option) {
    return "CAN interface '" + config_.interface + "' refuses " + option + ": " + std::strerror(errno);
  };
  const can_err_mask_t every_error = CAN_ERR_MASK;
  if (!set_option(socket_, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, every_error))
    return refused("CAN_RAW_ERR_FILTER");
  if (!set_option(socket_, SOL_CAN_RAW, CAN_RAW_RECV_OWN_MSGS, on)) return refused("CAN_RAW_RECV_OWN_MSGS");
  if (!set_option(socket_, SOL_SOCKET, SO_TIMESTAMPNS, on)) return refused("SO_TIMESTAMPNS");
  if (!set_option(socket_, SOL_SOCKET, SO_RXQ_OVFL, on)) return refused("SO_RXQ_OVFL");
  if (!set_option(socket_, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, on) && errno != ENOPROTOOPT) {
    return refused("CAN_RAW_FD_FRAMES");  // ENOPROTOOPT: the kernel does not support CAN FD
  }
  // The forced variants exceed the system's limits and need CAP_NET_ADMIN.
  const auto set_buffer = [&](int bytes, int forced, int ordinary) {
    return bytes <= 0 || set_option(socket_, SOL_SOCKET, forced, bytes) ||
           set_option(socket_, SOL_SOCKET, ordinary, bytes);
  };
  if (!set_buffer(config_.receive_buffer_bytes, SO_RCVBUFFORCE, SO_RCVBUF)) return refused("SO_RCVBUF");
  if (!set_buffer(config_.send_buffer_bytes, SO_SNDBUFFORCE, SO_SNDBUF)) return refused("SO_SNDBUF");
  last_overflow_ = 0;
  return {};
}

std::string SocketCanBus::apply_filters() {
  static constexpr can_filter everything{0, 0};
  std::span<const can_filter> list = filters_.filters();
  if (list.empty()) list = std::span(&everything, 1);
  if (::setsockopt(socket_, SOL_CAN_RAW, CAN_RAW_FILTER, list.data(),
                   static_cast<socklen_t>(list.size_bytes())) == 0) {
    return {};
  }
  return "CAN interface '" + config_.interface + "' refuses its filters: " + std::strerror(errno);
}

std::string SocketCanBus::fd_problem() const {
  ifreq request = request_for(config_.interface);
  if (socket_ < 0 || ::ioctl(socket_, SIOCGIFMTU, &request) != 0 ||
      static_cast<std::size_t>(request.ifr_mtu) >= CANFD_MTU)
    return {};
  return "the interface '" + config_.interface + "' carries classic frames only (its MTU is " +
         std::to_string(request.ifr_mtu) + "); set it down and then, for a vcan, 'ip link set " +
         config_.interface + " mtu 72', for a controller 'ip link set " + config_.interface +
         " type can bitrate 500000 dbitrate 2000000 fd on'";
}

void SocketCanBus::close() noexcept {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
  lost_ = false;
}

SendResult SocketCanBus::send(const Frame& frame) noexcept {
  send_error_ = ENETDOWN;
  if (socket_ < 0 || lost_) return SendResult::error;
  const ssize_t sent = ::send(socket_, &frame.raw, frame.struct_size(), MSG_DONTWAIT);
  if (sent == static_cast<ssize_t>(frame.struct_size())) {
    if (frame.is_discontinuous) discontinuous_.emplace_back(sent_, frame);
    ++sent_;
    return SendResult::sent;
  }
  if (sent < 0 && (errno == ENOBUFS || errno == EAGAIN || errno == EINTR)) return SendResult::no_buffer;
  send_error_ = sent < 0 ? errno : EIO;
  if (is_bus_gone(send_error_)) lose(send_error_);
  return SendResult::error;
}

ReceiveResult SocketCanBus::receive(Frame& frame) noexcept {
  while (socket_ >= 0) {
    iovec data{&frame.raw, sizeof frame.raw};
    alignas(cmsghdr) std::array<char, 256> control;
    msghdr message{};
    message.msg_iov = &data;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    const ssize_t size = ::recvmsg(socket_, &message, MSG_DONTWAIT);
    if (size >= 0) {
      if (fill(frame, message, static_cast<std::size_t>(size))) return ReceiveResult::frame;
      malformed_.fetch_add(1, std::memory_order_relaxed);
      continue;
    }
    if (errno == EINTR) continue;
    if (errno == EAGAIN) {
      if (!lost_) {
        receive_time_.socket_empty(read_clocks(*clock_).clocks);
        return ReceiveResult::empty;
      }
      close();  // everything that arrived before the loss has been delivered
      lost_ = true;
      break;
    }
    if (lost_ || !is_bus_gone(errno)) {
      lose(errno);
      close();
      lost_ = true;
      break;
    }
    lose(errno);  // the error is reported before the frames that are still queued: continue reading
  }
  return look_for_interface();
}

ReceiveResult SocketCanBus::look_for_interface() noexcept {
  if (!lost_) return ReceiveResult::empty;  // never opened, or closed
  const std::int64_t now_ns = read_clock_ns(CLOCK_MONOTONIC);
  if (now_ns < next_look_ns_) return ReceiveResult::lost;
  next_look_ns_ = now_ns + look_period_ns;
  if (!try_open().empty()) return ReceiveResult::lost;
  lost_ = false;
  discontinuous_.clear();
  received_back_ = sent_;
  set_fault({});
  reopened_.fetch_add(1, std::memory_order_relaxed);
  return ReceiveResult::empty;
}

void SocketCanBus::lose(int system_error) {
  lost_ = true;
  set_fault("CAN interface '" + config_.interface + "' is lost: " + std::strerror(system_error) +
            "; it is opened again when it is up");
}

bool SocketCanBus::fill(Frame& frame, msghdr& message, std::size_t size) noexcept {
  if (size != CAN_MTU && size != CANFD_MTU) return false;
  frame.is_fd = size == CANFD_MTU;
  if (!frame.is_fd) frame.raw.flags = 0;
  if (!valid_length(frame.raw.len, frame.is_fd)) return false;
  frame.direction = (message.msg_flags & MSG_CONFIRM) != 0 ? Direction::tx : Direction::rx;
  const Instant now = read_clocks(*clock_);
  frame.wall_ns = now.clocks.wall_ns;
  for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
    if (part->cmsg_level != SOL_SOCKET) continue;
    if (part->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(part), sizeof stamp);
      frame.wall_ns = std::int64_t{stamp.tv_sec} * 1'000'000'000 + stamp.tv_nsec;
    } else if (part->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t overflow = 0;
      std::memcpy(&overflow, CMSG_DATA(part), sizeof overflow);
      dropped_.fetch_add(overflow - last_overflow_, std::memory_order_relaxed);
      last_overflow_ = overflow;
    }
  }
  frame.time_ns = now.run_ns - receive_time_.age_ns(frame.wall_ns, now.clocks);
  frame.is_altered = false;
  frame.is_discontinuous = frame.direction == Direction::tx && takes_discontinuity(frame);
  return true;
}

bool SocketCanBus::takes_discontinuity(const Frame& frame) noexcept {
  // The dropped frames may all be own ones.
  const std::uint64_t latest = received_back_++ + dropped_.load(std::memory_order_relaxed);
  if (discontinuous_.empty()) return false;
  const auto& [number, sent] = discontinuous_.front();
  if (latest < number || !sent.same_content(frame)) return false;
  discontinuous_.pop_front();
  return true;
}

void SocketCanBus::set_filters(std::span<const can_filter> filters) {
  filters_.assign(filters);
  if (socket_ < 0) return;
  const std::string problem = apply_filters();
  if (!problem.empty()) throw DeviceError(problem);
}

ExchangeResult SocketCanBus::exchange(RunTimeNs) {
  require(false, "a kernel interface has no lock-step");
  return {};
}

BusCounters SocketCanBus::counters() const noexcept {
  return {dropped_.load(std::memory_order_relaxed),
          malformed_.load(std::memory_order_relaxed),
          reopened_.load(std::memory_order_relaxed),
          {}};
}

std::string SocketCanBus::fault() const {
  const std::lock_guard lock(fault_mutex_);
  return fault_;
}

void SocketCanBus::set_fault(std::string text) {
  const std::lock_guard lock(fault_mutex_);
  fault_ = std::move(text);
}

bool SocketCanBus::interface_is_up() const noexcept {
  ifreq request = request_for(config_.interface);
  return ::ioctl(socket_, SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) != 0;
}

}  // namespace hil::io::can
