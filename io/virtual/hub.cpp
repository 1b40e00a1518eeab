#include "io/virtual/hub.hpp"

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/timerfd.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>

namespace hil::io::virtual_bus {

namespace {

constexpr std::size_t packets_per_station = 64;  // read before the next station is served
// Over all stations in one receive(), a bound for stations that send invalid packets
constexpr int max_passes = 16;
constexpr std::size_t max_arrived = 65536;  // frames that receive() has not returned yet, in real time
constexpr std::ptrdiff_t max_closed_known = 64;
constexpr int station_buffer_bytes = 1 << 20;  // requested; the kernel grants up to net.core.wmem_max

std::int64_t wall_clock_ns() noexcept {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

}  // namespace

Hub::Hub(HubConfig config) : config_(std::move(config)), faults_(config_.faults) {
  if (config_.path.empty()) {
    own_folder_ = SocketFolder::make();
    config_.path = own_folder_.path() + "/" + config_.name;
  }
}

Hub::~Hub() {
  close();
}

void Hub::open(const RunClock& clock, Pacing pacing) {
  can::require(epoll_ < 0, "a bus is opened once");
  clock_ = &clock;
  pacing_ = pacing;
  listen();
  epoll_ = ::epoll_create1(EPOLL_CLOEXEC);
  timer_ = ::timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.ptr = nullptr;
  if (epoll_ < 0 || timer_ < 0 || ::epoll_ctl(epoll_, EPOLL_CTL_ADD, listener_, &event) != 0 ||
      ::epoll_ctl(epoll_, EPOLL_CTL_ADD, timer_, &event) != 0) {
    const std::string reason = std::strerror(errno);
    close();
    throw DeviceError(description() + " can not be opened: " + reason);
  }
}

void Hub::listen() {
  sockaddr_un place{};
  place.sun_family = AF_UNIX;
  if (config_.path.size() >= sizeof place.sun_path) {
    throw DeviceError(description() + " can not be opened: a socket's path has at most 107 bytes");
  }
  std::memcpy(place.sun_path, config_.path.c_str(), config_.path.size() + 1);
  const auto* const address = reinterpret_cast<const sockaddr*>(&place);
  const auto refuse = [&](const char* what) {
    const std::string reason = std::strerror(errno);
    if (listener_ >= 0) ::close(listener_);
    listener_ = -1;
    throw DeviceError(description() + " can not be opened: " + what + ": " + reason);
  };
  struct stat existing {};
  if (::lstat(config_.path.c_str(), &existing) == 0 && S_ISSOCK(existing.st_mode)) {
    const int probe = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    const bool in_use = probe >= 0 && (::connect(probe, address, sizeof place) == 0 || errno == EAGAIN);
    if (probe >= 0) ::close(probe);
    if (in_use) throw DeviceError(description() + " can not be opened: another program listens there");
    ::unlink(config_.path.c_str());
  }
  listener_ = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (listener_ < 0) refuse("socket");
  if (::bind(listener_, address, sizeof place) != 0) refuse("bind");
  if (::listen(listener_, SOMAXCONN) != 0) refuse("listen");
}

void Hub::close() noexcept {
  for (const auto& station : stations_)
    close_station(*station);
  stations_.clear();
  if (listener_ >= 0) {
    ::close(listener_);
    ::unlink(config_.path.c_str());
  }
  if (epoll_ >= 0) ::close(epoll_);
  if (timer_ >= 0) ::close(timer_);
  listener_ = epoll_ = timer_ = -1;
  for (const auto& [due_ns, held] : delayed_)
    faults_.count_lost(held.sender == own_station);
  delayed_.clear();
}

can::SendResult Hub::send(const can::Frame& frame) noexcept {
  if (epoll_ < 0 || !can::valid_length(frame.raw.len, frame.is_fd)) return can::SendResult::error;
  if (pacing_ == Pacing::lockstep) {
    staged_.push_back(frame);
  } else {
    route(frame, own_station);
  }
  return can::SendResult::sent;
}

can::ReceiveResult Hub::receive(can::Frame& frame) noexcept {
  if (pacing_ == Pacing::realtime && epoll_ >= 0) {
    for (int pass = 0; pass < max_passes && arrived_.empty() && pump(); ++pass) {
    }
  }
  if (arrived_.empty()) return can::ReceiveResult::empty;
  frame = arrived_.front();
  arrived_.pop_front();
  return can::ReceiveResult::frame;
}

// False: there was nothing to do.
bool Hub::pump() noexcept {
  std::array<epoll_event, 32> events{};
  const int count = ::epoll_wait(epoll_, events.data(), static_cast<int>(events.size()), 0);
  for (int index = 0; index < count; ++index) {
    if (auto* const station =
            static_cast<ConnectedStation*>(events[static_cast<std::size_t>(index)].data.ptr)) {
      read_station(*station, packets_per_station);
      continue;
    }
    std::uint64_t expirations = 0;
    static_cast<void>(::read(timer_, &expirations, sizeof expirations));
    accept_stations();
  }
  if (!delayed_.empty()) deliver_due(clock_->now_ns());
  remove_closed_stations();
  return count > 0;
}

void Hub::accept_stations() {
  while (true) {
    const int socket = ::accept4(listener_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (socket < 0) return;
    static_cast<void>(
        ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &station_buffer_bytes, sizeof station_buffer_bytes));
    auto station = std::make_unique<ConnectedStation>();
    station->socket = socket;
    station->connection = ++connections_;
    ucred peer{};
    socklen_t size = sizeof peer;
    static_cast<void>(::getsockopt(socket, SOL_SOCKET, SO_PEERCRED, &peer, &size));
    station->name = "pid " + std::to_string(peer.pid);
    station->counters = std::make_shared<StationCounters>();
    station->counters->name = station->name;
    station->counters->connection = station->connection;
    station->counters->process_group = peer.pid > 0 ? ::getpgid(peer.pid) : -1;
    station->counters->connected = true;
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.ptr = station.get();
    if (::epoll_ctl(epoll_, EPOLL_CTL_ADD, socket, &event) != 0) {
      ::close(socket);
      continue;
    }
    const std::lock_guard lock(mutex_);
    known_counters_.push_back(station->counters);
    stations_.push_back(std::move(station));
    station_count_.fetch_add(1, std::memory_order_relaxed);
  }
}

void Hub::read_station(ConnectedStation& station, std::size_t max_packets) {
  for (std::size_t count = 0; count < max_packets && station.socket >= 0; ++count) {
    if (!read_packet(station)) return;
  }
}

// False: no packet is available, or the station has closed.
bool Hub::read_packet(ConnectedStation& station) {
  PacketBuffer packet{};
  const ssize_t size = ::recv(station.socket, packet.data(), packet.size(), MSG_DONTWAIT);
  if (size < 0 && (errno == EAGAIN || errno == EINTR)) return false;
  if (size <= 0) {
    close_station(station);
    return false;
  }
  const auto length = static_cast<std::size_t>(size);
  if (const auto frame = frame_of(packet, length)) {
    {
      const std::lock_guard lock(mutex_);
      ++station.counters->received;
    }
    if (pacing_ == Pacing::lockstep) {
      station.inbox.push_back(*frame);
    } else {
      route(*frame, station.connection);
    }
    return true;
  }
  const auto time = time_packet_of(packet, length);
  if (time && time->kind == TimePacket::Kind::ack) {
    station.acks.push_back(time->sequence);
  } else if (const auto name = hello_name_of(packet, length); name && !station.greeted) {
    station.greeted = true;
    if (!name->empty()) station.name = *name;
    const std::lock_guard lock(mutex_);
    station.counters->name = station.name;
    station.counters->greeted = true;
  } else {
    malformed_.fetch_add(1, std::memory_order_relaxed);
  }
  return true;
}

void Hub::remove_closed_stations() {
  std::erase_if(stations_,
                [](const std::unique_ptr<ConnectedStation>& station) { return station->socket < 0; });
}

void Hub::close_station(ConnectedStation& station) noexcept {
  if (station.socket < 0) return;
  ::close(station.socket);
  station.socket = -1;
  station_count_.fetch_sub(1, std::memory_order_relaxed);
  const std::lock_guard lock(mutex_);
  station.counters->connected = false;
  forget_oldest_closed();
}

// Bounds memory when a station connects again and again. Requires the lock of the counters.
void Hub::forget_oldest_closed() noexcept {
  const auto is_closed = [](const auto& counters) { return !counters->connected; };
  if (std::count_if(known_counters_.begin(), known_counters_.end(), is_closed) <= max_closed_known) return;
  known_counters_.erase(std::find_if(known_counters_.begin(), known_counters_.end(), is_closed));
}

void Hub::route(can::Frame frame, ConnectionNumber sender) {
  const FaultInjector::FaultOutcome outcome = faults_.decide(frame, sender == own_station);
  if (outcome == FaultInjector::FaultOutcome::drop) {
    lost_ids_.insert(frame.raw.can_id);
  } else if (lost_ids_.erase(frame.raw.can_id) > 0) {
    frame.is_discontinuous = true;
  }
  switch (outcome) {
    case FaultInjector::FaultOutcome::drop:
      return;
    case FaultInjector::FaultOutcome::delay: {
      const RunTimeNs now_ns = pacing_ == Pacing::lockstep ? lockstep_now_ns_ : clock_->now_ns();
      delayed_.emplace(now_ns + faults_.delay_ns(), Delayed{frame, sender});
      if (pacing_ == Pacing::realtime) arm_timer();
      return;
    }
    case FaultInjector::FaultOutcome::deliver:
      return deliver(frame, sender);
  }
}

void Hub::deliver(can::Frame frame, ConnectionNumber sender) {
  frame.direction = sender == own_station ? can::Direction::tx : can::Direction::rx;
  frame.time_ns = pacing_ == Pacing::lockstep ? lockstep_now_ns_ : clock_->now_ns();
  frame.wall_ns = pacing_ == Pacing::lockstep ? lockstep_now_ns_ : wall_clock_ns();
  if (filters_.passes(frame.raw.can_id)) {
    if (pacing_ == Pacing::realtime && arrived_.size() >= max_arrived) {
      dropped_.fetch_add(1, std::memory_order_relaxed);
    } else {
      arrived_.push_back(frame);
    }
  }
  for (const auto& station : stations_) {
    if (station->connection == sender || station->socket < 0) continue;
    const bool written = write(*station, &frame.raw, frame.struct_size());
    station->has_unacknowledged = true;
    if (!written) dropped_.fetch_add(1, std::memory_order_relaxed);
    const std::lock_guard lock(mutex_);
    ++(written ? station->counters->delivered : station->counters->dropped);
  }
}

void Hub::deliver_due(RunTimeNs now_ns) {
  while (!delayed_.empty() && delayed_.begin()->first <= now_ns) {
    const Delayed next = delayed_.begin()->second;
    delayed_.erase(delayed_.begin());
    deliver(next.frame, next.sender);
  }
  if (pacing_ == Pacing::realtime) arm_timer();
}

void Hub::arm_timer() noexcept {
  itimerspec when{};  // all zero: off
  if (!delayed_.empty()) {
    const std::int64_t wait_ns = std::max<std::int64_t>(delayed_.begin()->first - clock_->now_ns(), 1);
    when.it_value.tv_sec = wait_ns / 1'000'000'000;
    when.it_value.tv_nsec = wait_ns % 1'000'000'000;
  }
  static_cast<void>(::timerfd_settime(timer_, 0, &when, nullptr));
}

can::BusCounters Hub::counters() const noexcept {
  return {dropped_.load(std::memory_order_relaxed), malformed_.load(std::memory_order_relaxed), 0,
          faults_.counters()};
}

std::string Hub::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

void Hub::set_fault(std::string text) {
  const std::lock_guard lock(mutex_);
  fault_ = std::move(text);
}

std::vector<StationCounters> Hub::station_counters() const {
  const std::lock_guard lock(mutex_);
  std::vector<StationCounters> all;
  for (const auto& counters : known_counters_)
    all.push_back(*counters);
  return all;
}

}  // namespace hil::io::virtual_bus
