#pragma once
// A CAN interface of the kernel (can0, vcan0) through a raw socket.
//
// The socket also receives the frames of this station, so receive() returns the order of the bus. It receives
// error frames. Times are the kernel's receive timestamps and do not jump when the wall clock is set
// (receive_time.hpp). FD frames are supported if the interface supports them. Frames that the full socket
// dropped are counted by the kernel.
//
// When an interface goes down or is deleted, receive() returns lost; it still returns the frames that arrived
// before. When an interface of that name is up again, it is reopened.
//
// Threads: as in bus.hpp.

#include <sys/socket.h>

#include <atomic>
#include <deque>
#include <mutex>
#include <string>
#include <utility>

#include "io/can/can_transport.hpp"
#include "io/can/filter.hpp"
#include "io/can/receive_time.hpp"

namespace hil::io::can {

struct SocketCanConfig {
  std::string interface;  ///< "vcan0"
  /// Requested size, which the kernel may limit for ordinary users. The default holds about half a second of
  /// a saturated 1 Mbit/s bus; 0: the kernel's default.
  int receive_buffer_bytes = 4 << 20;
  int send_buffer_bytes = 0;  ///< likewise; 0: the kernel's default
};

class SocketCanBus final : public CanTransport {
 public:
  explicit SocketCanBus(SocketCanConfig config) : config_(std::move(config)) {}
  ~SocketCanBus() override { close(); }
  SocketCanBus(const SocketCanBus&) = delete;
  SocketCanBus& operator=(const SocketCanBus&) = delete;

  const std::string& name() const noexcept override { return config_.interface; }
  std::string description() const override { return "SocketCAN interface " + config_.interface; }
  /// Throws DeviceError also for Pacing::lockstep: a kernel interface keeps wall-clock time.
  void open(const RunClock& clock, Pacing pacing) override;
  void close() noexcept override;
  std::string fd_problem() const override;
  int fd() const noexcept override { return socket_; }
  SendResult send(const Frame& frame) noexcept override;
  int send_error() const noexcept override { return send_error_; }
  ReceiveResult receive(Frame& frame) noexcept override;
  void set_filters(std::span<const can_filter> filters) override;
  ExchangeResult exchange(RunTimeNs now_ns) override;
  BusCounters counters() const noexcept override;
  std::string fault() const override;

 private:
  /// Opens and binds the socket. Returns an empty text, or the reason for the failure as a sentence.
  std::string try_open();
  std::string bind_to_interface();
  std::string set_options();
  std::string apply_filters();
  bool interface_is_up() const noexcept;
  ReceiveResult look_for_interface() noexcept;
  void lose(int system_error);
  bool fill(Frame& frame, msghdr& message, std::size_t size) noexcept;
  /// Whether the own frame that came back was sent as a discontinuous one. The kernel returns own frames in
  /// the order of sending, without those that the full socket dropped.
  bool takes_discontinuity(const Frame& frame) noexcept;
  void set_fault(std::string text);

  SocketCanConfig config_;
  FilterSet filters_;
  const RunClock* clock_ = nullptr;
  ReceiveTime receive_time_;
  int socket_ = -1;
  int send_error_ = 0;
  bool lost_ = false;                ///< no frames beyond those that the socket still holds
  std::int64_t next_look_ns_ = 0;    ///< monotonic time of the next attempt to reopen the interface
  std::uint32_t last_overflow_ = 0;  ///< the kernel's count for this socket
  /// Frames that were sent as discontinuous and have not come back, with their numbers in the order of
  /// sending.
  std::deque<std::pair<std::uint64_t, Frame>> discontinuous_;
  std::uint64_t sent_ = 0, received_back_ = 0;  ///< own frames

  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> malformed_{0};
  std::atomic<std::uint64_t> reopened_{0};
  mutable std::mutex fault_mutex_;
  std::string fault_;
};

}  // namespace hil::io::can
