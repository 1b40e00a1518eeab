#pragma once
// A CAN interface of the kernel (can0, vcan0) through a raw socket.
//
// Own frames are received too, so receive() gives the order of the bus. Error frames are received. Times are
// the kernel's receive timestamps; setting the wall clock does not move them (receive_time.hpp). FD frames
// pass where the interface can carry them. A frame that our socket had no room for is counted as dropped, by
// the kernel's own count.
//
// An interface that goes down or is deleted makes receive() say lost; frames that arrived before are still
// delivered. When an interface of that name is up again it is opened anew.
//
// Threads: as bus.hpp says.

#include <sys/socket.h>

#include <atomic>
#include <mutex>
#include <string>

#include "io/can/bus.hpp"
#include "io/can/filter.hpp"
#include "io/can/receive_time.hpp"

namespace hil::io::can {

struct SocketCanConfig {
  std::string interface;  ///< "vcan0"
  /// Asked of the kernel, which may grant less to an ordinary user. The default holds about half a second of
  /// a saturated 1 Mbit/s bus; 0: the kernel's own.
  int receive_buffer_bytes = 4 << 20;
  int send_buffer_bytes = 0;  ///< the same; 0: the kernel's own
};

class SocketCanBus final : public Bus {
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
  SettleResult settle(RunTimeNs now_ns) override;
  BusCounters counters() const noexcept override;
  std::string fault() const override;

 private:
  /// Opens and binds the socket. Empty: done; else why not, as a sentence.
  std::string try_open();
  std::string bind_to_interface();
  std::string set_options();
  std::string apply_filters();
  bool interface_is_up() const noexcept;
  ReceiveResult look_for_interface() noexcept;
  void lose(int system_error);
  bool fill(Frame& frame, msghdr& message, std::size_t size) noexcept;
  void set_fault(std::string text);

  SocketCanConfig config_;
  FilterSet filters_;
  const RunClock* clock_ = nullptr;
  ReceiveTime receive_time_;
  int socket_ = -1;
  int send_error_ = 0;
  bool lost_ = false;                ///< no more frames than those the socket still holds
  std::int64_t next_look_ns_ = 0;    ///< monotonic: when to try the interface again
  std::uint32_t last_overflow_ = 0;  ///< the kernel's count for this socket

  std::atomic<std::uint64_t> dropped_{0};
  std::atomic<std::uint64_t> malformed_{0};
  std::atomic<std::uint64_t> reopened_{0};
  mutable std::mutex fault_mutex_;
  std::string fault_;
};

}  // namespace hil::io::can
