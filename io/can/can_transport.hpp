#pragma once
// The port to one CAN bus: a station that sends and receives frames. Implemented by a kernel interface
// (socketcan_bus.hpp) and by the hub and the stations of the virtual bus (io/virtual).
//
// Threads: one thread at a time, except counters() and fault(), which any thread may call. Only open() and
// exchange() block.

#include <linux/can.h>

#include <cstdint>
#include <span>
#include <string>

#include "io/can/frame.hpp"
#include "io/device.hpp"

namespace hil::io::can {

enum class SendResult : std::uint8_t {
  sent,       ///< the bus has taken the frame
  no_buffer,  ///< the queue towards the bus is full (ENOBUFS, EAGAIN); try again later, not at once
  error,      ///< the frame can not be sent; send_error() gives the reason
};

enum class ReceiveResult : std::uint8_t {
  frame,  ///< `frame` was filled
  empty,  ///< no frame is available
  lost,   ///< the bus is currently lost (interface down or deleted, hub closed)
};

/// What fault injection did to frames (io/virtual/faults.hpp); always zero on a real bus.
struct InjectedFaults {
  std::uint64_t dropped_tx = 0;  ///< frames that this station sent and the bus never carried
  std::uint64_t dropped_rx = 0;  ///< the same for frames of other stations
  std::uint64_t corrupted = 0;
  std::uint64_t delayed = 0;
};

struct BusCounters {
  std::uint64_t dropped =
      0;  ///< frames that this station (for a hub: one that is connected) was too slow to read
  std::uint64_t malformed = 0;  ///< packets that are not frames
  std::uint64_t reopened = 0;   ///< how often a lost bus became available again
  InjectedFaults injected;
};

/// The result of exchange().
struct ExchangeResult {
  enum class Status : std::uint8_t {
    completed,
    stations_missing,   ///< fewer stations connected than expected; `station` is their number
    station_timed_out,  ///< no acknowledgement within the limit
    station_ended,      ///< its connection closed
    too_many_rounds,    ///< stations did not stop replying to each other
  };
  Status status = Status::completed;
  std::string station;  ///< the name of the station that caused the failure
  bool completed() const noexcept { return status == Status::completed; }
};

class CanTransport {
 public:
  virtual ~CanTransport() = default;

  /// The name of the interface or bus in logs: "vcan0", "car".
  virtual const std::string& name() const noexcept = 0;
  /// For messages and reports: "SocketCAN interface vcan0".
  virtual std::string description() const = 0;

  /// Throws DeviceError, also when this bus does not support `pacing`. `clock` outlives the bus.
  virtual void open(const RunClock& clock, Pacing pacing) = 0;
  virtual void close() noexcept = 0;

  /// Why the open bus can not carry FD frames, and what to do, as a clause. Empty: it can carry them.
  virtual std::string fd_problem() const { return {}; }

  /// A descriptor that is readable when receive() has something to do; -1 if there is none. Any call of
  /// receive() can change it. Frames of this station need not make it readable: after send(), call receive()
  /// until it returns empty before waiting.
  virtual int fd() const noexcept = 0;

  /// Never blocks.
  virtual SendResult send(const Frame& frame) noexcept = 0;
  /// The system's error number of the last SendResult::error (ENETDOWN: the bus is lost).
  virtual int send_error() const noexcept = 0;
  /// Never blocks. Frames of this station are returned with Direction::tx, at their place in the order of the
  /// bus. If the bus is lost, this call tries to reopen it every 20 ms.
  virtual ReceiveResult receive(Frame& frame) noexcept = 0;

  /// Selects the frames that receive() returns from now on; empty: all frames.
  virtual void set_filters(std::span<const can_filter> filters) = 0;

  /// Lock-step only: advances every station to run time `now_ns`, delivers all frames, and returns when every
  /// station is idle and no frame is pending, or when a wall-clock limit has passed. Misuse (asserts):
  /// another pacing.
  virtual ExchangeResult exchange(RunTimeNs now_ns) = 0;

  /// Lock-step: see Device::set_away.
  virtual void set_away(int process_group, bool away) {
    static_cast<void>(process_group), static_cast<void>(away);
  }

  virtual BusCounters counters() const noexcept = 0;
  /// Why the bus is lost, as a sentence; empty: it is not.
  virtual std::string fault() const = 0;
};

}  // namespace hil::io::can
