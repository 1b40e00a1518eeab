// The hub under the virtual clock: exchange() and its steps.

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <tuple>

#include "io/virtual/hub.hpp"

namespace hil::io::virtual_bus {

namespace {

constexpr int max_rounds = 1000;  // per step: stations that still reply to each other then will not stop

/// A wall-clock limit.
class Limit {
 public:
  explicit Limit(std::int64_t limit_ns)
      : end_(std::chrono::steady_clock::now() + std::chrono::nanoseconds(limit_ns)) {}

  /// Waits for events on `fd`. False: the limit has passed.
  bool wait(int fd, short events) const noexcept {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end_ - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd watched{fd, events, 0};
    const int ready = ::poll(&watched, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 1'000'000)));
    return ready != 0;  // interrupted by a signal: the caller checks again
  }

 private:
  std::chrono::steady_clock::time_point end_;
};

}  // namespace

// In real time, and for a station that is away, a full socket loses the packet. Otherwise this waits and
// reads from the station, since the station may itself wait until the hub reads.
bool Hub::write(ConnectedStation& station, const void* data, std::size_t size) noexcept {
  const Limit limit(pacing_ == Pacing::lockstep ? config_.answer_limit_ns : 0);
  while (station.socket >= 0) {
    if (::send(station.socket, data, size, MSG_DONTWAIT | MSG_NOSIGNAL) == static_cast<ssize_t>(size))
      return true;
    if (errno == EINTR) continue;
    if (errno != EAGAIN) {
      close_station(station);
      return false;
    }
    if (pacing_ == Pacing::realtime || is_away(station) || !limit.wait(station.socket, POLLOUT | POLLIN))
      return false;
    while (read_packet(station)) {
    }
  }
  return false;
}

bool Hub::send_time(ConnectedStation& station, TimePacket::Kind kind, std::uint64_t sequence) noexcept {
  TimePacket packet;
  packet.kind = kind;
  packet.sequence = sequence;
  packet.run_time_ns = lockstep_now_ns_;
  return write(station, &packet, sizeof packet);
}

std::size_t Hub::greeted_count() const noexcept {
  return static_cast<std::size_t>(std::count_if(stations_.begin(), stations_.end(), [](const auto& station) {
    return station->greeted && station->socket >= 0;
  }));
}

void Hub::accept_waiting_stations() {
  can::require(pacing_ == Pacing::lockstep && epoll_ >= 0,
               "accept_waiting_stations needs an open bus in lock-step");
  accept_stations();
  for (const auto& station : stations_) {
    while (!station->greeted && read_packet(*station)) {
    }
  }
  remove_closed_stations();
}

void Hub::set_away(int process_group, bool away) {
  if (away) {
    away_.insert(process_group);
  } else {
    away_.erase(process_group);
  }
}

bool Hub::wait_for_stations() {
  const Limit limit(config_.connect_limit_ns);
  while (true) {
    accept_waiting_stations();
    if (greeted_count() >= config_.expected_stations) return true;
    if (!limit.wait(epoll_, POLLIN)) return false;
  }
}

void Hub::open_step() {
  std::sort(stations_.begin(), stations_.end(), [](const auto& one, const auto& other) {
    return std::tie(one->name, one->connection) < std::tie(other->name, other->connection);
  });
  for (const auto& station : stations_) {
    if (!station->greeted || is_away(*station)) continue;
    send_time(*station, TimePacket::Kind::now, sequence_);
    station->has_unacknowledged = true;  // also after a failure, which its barrier then reports
  }
  deliver_due(lockstep_now_ns_);
  std::vector<can::Frame> staged;
  staged.swap(staged_);
  for (const can::Frame& frame : staged)
    route(frame, own_station);
}

can::ExchangeResult Hub::exchange(RunTimeNs now_ns) {
  can::require(pacing_ == Pacing::lockstep && epoll_ >= 0, "exchange belongs to an open bus in lock-step");
  lockstep_now_ns_ = now_ns;
  if (!lost_.completed()) {
    open_step();  // delivers what was sent, for instance safe values, to the remaining stations
    return lost_;
  }
  if (!complete_ && !wait_for_stations()) {
    return fail(can::ExchangeResult::Status::stations_missing,
                std::to_string(greeted_count()) + " of " + std::to_string(config_.expected_stations));
  }
  if (complete_) {  // later stations may join but are not awaited
    accept_stations();
    for (const auto& station : stations_) {
      if (!station->greeted) read_packet(*station);
    }
  }
  complete_ = true;
  open_step();
  for (int round = 0; round < max_rounds; ++round) {
    bool quiet = true;
    can::ExchangeResult result = exchange_round(quiet);
    if (!result.completed()) return result;
    if (quiet) {
      remove_closed_stations();
      return {};
    }
  }
  return fail(can::ExchangeResult::Status::too_many_rounds, stations_.empty() ? "" : stations_.front()->name);
}

can::ExchangeResult Hub::exchange_round(bool& quiet) {
  for (const auto& station : stations_) {
    if (!station->greeted || !station->has_unacknowledged || is_away(*station)) continue;
    quiet = false;
    station->has_unacknowledged = false;
    const std::uint64_t sequence = ++sequence_;
    auto status = can::ExchangeResult::Status::station_ended;
    if (send_time(*station, TimePacket::Kind::barrier, sequence)) {
      status = wait_for_ack(*station, sequence);
    } else if (station->socket >= 0) {
      status = can::ExchangeResult::Status::station_timed_out;
    }
    // A station that only listens may leave; an expected one may not.
    const bool may_leave =
        status == can::ExchangeResult::Status::station_ended && greeted_count() >= config_.expected_stations;
    if (status != can::ExchangeResult::Status::completed && !may_leave) return fail(status, station->name);
    std::deque<can::Frame> sent;
    sent.swap(station->inbox);
    for (const can::Frame& frame : sent)
      route(frame, station->connection);
  }
  return {};
}

can::ExchangeResult::Status Hub::wait_for_ack(ConnectedStation& station, std::uint64_t sequence) {
  const Limit limit(config_.answer_limit_ns);
  while (true) {
    while (!station.acks.empty()) {
      const std::uint64_t acknowledged = station.acks.front();
      station.acks.pop_front();
      if (acknowledged == sequence) return can::ExchangeResult::Status::completed;
    }
    if (read_packet(station)) continue;
    if (station.socket < 0) return can::ExchangeResult::Status::station_ended;
    if (!limit.wait(station.socket, POLLIN)) return can::ExchangeResult::Status::station_timed_out;
  }
}

can::ExchangeResult Hub::fail(can::ExchangeResult::Status status, const std::string& station) {
  const std::string bus = "virtual CAN bus '" + config_.name + "': ";
  switch (status) {
    case can::ExchangeResult::Status::completed:
      break;
    case can::ExchangeResult::Status::stations_missing:
      set_fault(bus + station + " expected stations have connected within the limit");
      break;
    case can::ExchangeResult::Status::station_timed_out:
      set_fault(bus + "station '" + station + "' did not answer within " +
                std::to_string(config_.answer_limit_ns / 1'000'000) + " ms");
      break;
    case can::ExchangeResult::Status::station_ended:
      set_fault(bus + "station '" + station + "' closed its connection");
      break;
    case can::ExchangeResult::Status::too_many_rounds:
      set_fault(bus + "stations, '" + station + "' among them, answer each other without end");
      break;
  }
  lost_ = {status, station};
  return lost_;
}

}  // namespace hil::io::virtual_bus
