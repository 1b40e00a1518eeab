#pragma once
// A station on a virtual bus in another process (hub.hpp), for programs that simulate a device under test.
//
// The hub, not the `pacing` given to open(), decides whether the bus is in lock-step. In lock-step, frames
// carry the hub's run time. The hub waits until this station has called receive() again and got nothing;
// everything it sends before that belongs to the same instant.
//
// Threads: as in io/can/can_transport.hpp.

#include <atomic>
#include <cerrno>
#include <mutex>
#include <string>

#include "io/can/can_transport.hpp"
#include "io/can/filter.hpp"
#include "io/virtual/packet.hpp"

namespace hil::io::virtual_bus {

struct StationConfig {
  std::string address;  ///< "unix:/path"
  std::string name;     ///< of this station, at most 55 bytes; determines its position in lock-step
  std::int64_t connect_limit_ns = 5'000'000'000;  ///< the hub may open later
};

class Station final : public can::CanTransport {
 public:
  explicit Station(StationConfig config) : config_(std::move(config)) {}
  ~Station() override { close(); }
  Station(const Station&) = delete;
  Station& operator=(const Station&) = delete;

  const std::string& name() const noexcept override { return config_.name; }
  std::string description() const override { return "virtual CAN bus at " + config_.address; }
  /// Waits for the hub, up to the limit.
  void open(const RunClock& clock, Pacing pacing) override;
  void close() noexcept override;
  int fd() const noexcept override { return socket_; }
  /// In lock-step this waits until the hub has taken the frame.
  can::SendResult send(const can::Frame& frame) noexcept override;
  int send_error() const noexcept override { return socket_ < 0 || lost_ ? ENETDOWN : EINVAL; }
  /// Does not return frames of this station. A closed hub is lost permanently.
  can::ReceiveResult receive(can::Frame& frame) noexcept override;
  void set_filters(std::span<const can_filter> filters) override { filters_.assign(filters); }
  /// Misuse (asserts): only a hub exchanges.
  can::ExchangeResult exchange(RunTimeNs now_ns) override;
  can::BusCounters counters() const noexcept override;
  std::string fault() const override;

  /// True once the hub has sent a time.
  bool is_lockstep() const noexcept { return lockstep_; }
  /// Lock-step: the current run time; otherwise the clock's.
  RunTimeNs now_ns() const noexcept { return lockstep_ ? lockstep_now_ns_ : clock_->now_ns(); }

 private:
  void take_time(const TimePacket& packet) noexcept;
  can::ReceiveResult lose(const char* reason) noexcept;

  StationConfig config_;
  can::FilterSet filters_;
  const RunClock* clock_ = nullptr;
  int socket_ = -1;
  bool lost_ = false;
  bool lockstep_ = false;
  RunTimeNs lockstep_now_ns_ = 0;
  std::atomic<std::uint64_t> malformed_{0};
  mutable std::mutex fault_mutex_;
  std::string fault_;
};

}  // namespace hil::io::virtual_bus
