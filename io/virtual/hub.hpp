#pragma once
// A CAN bus without a kernel interface: a hub in this process on a Unix SOCK_SEQPACKET socket, which carries
// the kernel's frame structs (packet.hpp). This process is a station, and so is each connected process.
// Every frame is delivered to every other station, in one total order, which is also the order in which
// receive() returns frames.
//
// Real time: the hub works inside receive(), which its owner calls whenever fd() is readable. A station with
// a full socket loses the frame, which is counted; the hub never waits.
//
// Lock-step: frames move only in exchange(). The hub serves the stations one after the other, ordered by name
// and then by connection, until a round brings no new frame. So the order of frames is the same in every run.
// No frame is dropped. Frames carry the run time of the exchange() that delivered them.
//
// Threads: as in io/can/can_transport.hpp; any thread may call station_count() and station_counters().

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "io/can/can_transport.hpp"
#include "io/can/filter.hpp"
#include "io/virtual/faults.hpp"
#include "io/virtual/packet.hpp"
#include "io/virtual/socket_folder.hpp"

namespace hil::io::virtual_bus {

struct HubConfig {
  std::string name;  ///< name of the bus in logs
  /// Path of the socket, at most 107 bytes; empty: in a new folder under $TMPDIR or /tmp.
  std::string path;
  FaultConfig faults;
  /// Lock-step: the first exchange() waits until this many stations have connected.
  std::size_t expected_stations = 0;
  /// Wall-clock limits of that wait and of one station's acknowledgement of a barrier.
  std::int64_t connect_limit_ns = 10'000'000'000;
  std::int64_t answer_limit_ns = 2'000'000'000;
};

struct StationCounters {
  std::string name;
  std::uint64_t connection = 0;  ///< counts from 1, in the order of connecting
  pid_t process_group = -1;      ///< of the process that connected; -1: unknown
  bool greeted = false;          ///< it has sent its name, so it takes part in lock-step
  bool connected = false;
  std::uint64_t delivered = 0;  ///< frames sent to it
  std::uint64_t dropped = 0;    ///< frames that its full socket lost
  std::uint64_t received = 0;   ///< frames received from it
};

class Hub final : public can::CanTransport {
 public:
  explicit Hub(HubConfig config);
  ~Hub() override;
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  /// The address for stations: "unix:/path". Known from construction on; the socket exists from open() on.
  std::string address() const { return "unix:" + config_.path; }

  const std::string& name() const noexcept override { return config_.name; }
  std::string description() const override { return "virtual CAN bus " + config_.name + " at " + address(); }
  /// Replaces a socket file that no process listens on. Throws DeviceError if one is in use.
  void open(const RunClock& clock, Pacing pacing) override;
  void close() noexcept override;
  int fd() const noexcept override { return epoll_; }
  can::SendResult send(const can::Frame& frame) noexcept override;
  int send_error() const noexcept override { return epoll_ < 0 ? ENETDOWN : EINVAL; }
  can::ReceiveResult receive(can::Frame& frame) noexcept override;
  void set_filters(std::span<const can_filter> filters) override { filters_.assign(filters); }
  can::ExchangeResult exchange(RunTimeNs now_ns) override;
  void set_away(int process_group, bool away) override;
  /// Lock-step: accepts the stations that have connected; never waits. For an owner that reads
  /// station_counters() before the first exchange(). In real time receive() does it.
  void accept_waiting_stations();
  /// dropped: the sum over all stations. injected: a delayed frame that is still held when the bus closes
  /// counts as dropped.
  can::BusCounters counters() const noexcept override;
  std::string fault() const override;

  /// The number of connected stations.
  std::size_t station_count() const noexcept { return station_count_.load(std::memory_order_relaxed); }
  /// All connected stations and the last 64 that have disconnected, in the order of connecting.
  std::vector<StationCounters> station_counters() const;

 private:
  struct ConnectedStation {
    int socket = -1;
    std::uint64_t connection = 0;
    std::string name;
    bool greeted = false;
    bool has_unacknowledged = false;  ///< lock-step: has received something since its last acknowledgement
    std::deque<can::Frame> inbox;     ///< lock-step: read but not routed
    std::deque<std::uint64_t> acks;   ///< lock-step: read but not awaited
    std::shared_ptr<StationCounters> counters;
  };
  using ConnectionNumber = std::uint64_t;
  static constexpr ConnectionNumber own_station = 0;
  struct Delayed {
    can::Frame frame;
    ConnectionNumber sender;
  };

  void listen();
  bool is_away(const ConnectedStation& station) const noexcept {
    return away_.contains(station.counters->process_group);
  }
  bool pump() noexcept;
  void accept_stations();
  void read_station(ConnectedStation& station, std::size_t max_packets);
  bool read_packet(ConnectedStation& station);
  void greet(ConnectedStation& station, const PacketBuffer& packet, std::size_t size);
  void remove_closed_stations();
  void close_station(ConnectedStation& station) noexcept;
  void forget_oldest_closed() noexcept;
  std::size_t greeted_count() const noexcept;

  void route(can::Frame frame, ConnectionNumber sender);
  void deliver(can::Frame frame, ConnectionNumber sender);
  void deliver_due(RunTimeNs now_ns);
  void arm_timer() noexcept;
  bool write(ConnectedStation& station, const void* data, std::size_t size) noexcept;

  bool wait_for_stations();
  bool send_time(ConnectedStation& station, TimePacket::Kind kind, std::uint64_t sequence) noexcept;
  can::ExchangeResult::Status wait_for_ack(ConnectedStation& station, std::uint64_t sequence);
  /// Performs one barrier with every station that has received something. `quiet`: there was no such station.
  can::ExchangeResult exchange_round(bool& quiet);
  void open_step();
  can::ExchangeResult fail(can::ExchangeResult::Status status, const std::string& station);
  void set_fault(std::string text);

  HubConfig config_;
  SocketFolder own_folder_;  ///< for a socket without a configured path
  FaultInjector faults_;
  can::FilterSet filters_;
  const RunClock* clock_ = nullptr;
  Pacing pacing_ = Pacing::realtime;
  int epoll_ = -1;
  int listener_ = -1;
  int timer_ = -1;

  std::vector<std::unique_ptr<ConnectedStation>> stations_;
  std::uint64_t connections_ = 0;
  std::deque<can::Frame> arrived_;  ///< for receive()
  std::multimap<RunTimeNs, Delayed> delayed_;
  std::set<canid_t> lost_ids_;  ///< identifiers of dropped frames, until a frame with the identifier passes

  std::vector<can::Frame> staged_;  ///< lock-step: sent by this process since the last exchange()
  RunTimeNs lockstep_now_ns_ = 0;
  std::uint64_t sequence_ = 0;
  bool complete_ = false;     ///< all expected stations have connected
  can::ExchangeResult lost_;  ///< lock-step: after a station ended or did not answer, every later step fails

  std::set<pid_t> away_;  ///< lock-step: process groups whose stations are not awaited

  std::atomic<std::size_t> station_count_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> malformed_{0};
  mutable std::mutex mutex_;  ///< fault_ and the counters of stations
  std::string fault_;
  std::vector<std::shared_ptr<StationCounters>> known_counters_;
};

}  // namespace hil::io::virtual_bus
