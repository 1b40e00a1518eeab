#pragma once
// A CAN bus without a kernel interface: a hub in this process on a Unix SOCK_SEQPACKET socket, which carries
// the kernel's frame structs (packet.hpp). This process and any number of clients are stations. Every frame
// is delivered to every other station, in one total order, which is also the order in which receive() returns
// frames.
//
// Real time: the hub works inside receive(), which its owner calls whenever fd() is readable. A client with a
// full socket loses the frame, which is counted; the hub never waits.
//
// Lock-step: frames move only in settle(). The hub serves the clients one after the other, ordered by name
// and then by connection, until a round brings no new frame. So the order of frames is the same in every run.
// No frame is dropped. Frames carry the run time of the settle() that delivered them.
//
// Threads: as in io/can/bus.hpp; any thread may call station_count() and client_counters().

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "io/can/bus.hpp"
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
  /// Lock-step: the first settle() waits until this many clients have connected.
  std::size_t expected_stations = 0;
  /// Wall-clock limits of that wait and of one client's acknowledgement of a barrier.
  std::int64_t connect_limit_ns = 10'000'000'000;
  std::int64_t answer_limit_ns = 2'000'000'000;
};

struct ClientCounters {
  std::string name;
  std::uint64_t connection = 0;  ///< counts from 1, in the order of connecting
  pid_t process_group = -1;      ///< of the process that connected; -1: unknown
  bool greeted = false;          ///< it has sent its name, so it takes part in lock-step
  bool connected = false;
  std::uint64_t delivered = 0;  ///< frames sent to it
  std::uint64_t dropped = 0;    ///< frames that its full socket lost
  std::uint64_t received = 0;   ///< frames received from it
};

class Hub final : public can::Bus {
 public:
  explicit Hub(HubConfig config);
  ~Hub() override;
  Hub(const Hub&) = delete;
  Hub& operator=(const Hub&) = delete;

  /// The address for clients: "unix:/path". Known from construction on; the socket exists from open() on.
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
  can::SettleResult settle(RunTimeNs now_ns) override;
  /// Lock-step: accepts the clients that have connected; never waits. For an owner that reads
  /// client_counters() before the first settle(). In real time receive() does it.
  void accept_waiting_clients();
  /// dropped: the sum over all clients. injected: a delayed frame that is still held when the bus closes
  /// counts as dropped.
  can::BusCounters counters() const noexcept override;
  std::string fault() const override;

  /// The number of connected clients.
  std::size_t station_count() const noexcept { return station_count_.load(std::memory_order_relaxed); }
  /// All connected clients and the last 64 that have disconnected, in the order of connecting.
  std::vector<ClientCounters> client_counters() const;

 private:
  struct Client {
    int socket = -1;
    std::uint64_t connection = 0;
    std::string name;
    bool greeted = false;
    bool unsettled = false;          ///< lock-step: has received something since its last acknowledgement
    std::deque<can::Frame> inbox;    ///< lock-step: read but not routed
    std::deque<std::uint64_t> acks;  ///< lock-step: read but not awaited
    std::shared_ptr<ClientCounters> counters;
  };
  using Station = std::uint64_t;  ///< a client's connection number
  static constexpr Station own_station = 0;
  struct Delayed {
    can::Frame frame;
    Station sender;
  };

  void listen();
  bool pump() noexcept;
  void accept_clients();
  void read_client(Client& client, std::size_t max_packets);
  bool read_packet(Client& client);
  void greet(Client& client, const PacketBuffer& packet, std::size_t size);
  void remove_closed_clients();
  void close_client(Client& client) noexcept;
  void forget_oldest_closed() noexcept;
  std::size_t greeted_count() const noexcept;

  void route(can::Frame frame, Station sender);
  void deliver(can::Frame frame, Station sender);
  void deliver_due(RunTimeNs now_ns);
  void arm_timer() noexcept;
  bool write(Client& client, const void* data, std::size_t size) noexcept;

  bool wait_for_clients();
  bool send_time(Client& client, TimePacket::Kind kind, std::uint64_t sequence) noexcept;
  can::SettleResult::Status wait_for_ack(Client& client, std::uint64_t sequence);
  /// Performs one barrier with every client that has received something. `quiet`: there was no such client.
  can::SettleResult settle_round(bool& quiet);
  void open_step();
  can::SettleResult fail(can::SettleResult::Status status, const std::string& client);
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

  std::vector<std::unique_ptr<Client>> clients_;
  std::uint64_t connections_ = 0;
  std::deque<can::Frame> arrived_;  ///< for receive()
  std::multimap<RunTimeNs, Delayed> delayed_;

  std::vector<can::Frame> staged_;  ///< lock-step: sent by this process since the last settle()
  RunTimeNs lockstep_now_ns_ = 0;
  std::uint64_t sequence_ = 0;
  bool complete_ = false;   ///< all expected clients have connected
  can::SettleResult lost_;  ///< lock-step: after a client died or hung, every later step fails

  std::atomic<std::size_t> station_count_{0};
  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> malformed_{0};
  mutable std::mutex mutex_;  ///< fault_ and the counters of clients
  std::string fault_;
  std::vector<std::shared_ptr<ClientCounters>> known_counters_;
};

}  // namespace hil::io::virtual_bus
