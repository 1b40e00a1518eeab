#pragma once
// The port to one CAN bus: a station that sends and receives frames. Behind it: a kernel interface
// (socketcan_bus.hpp), or the hub or a client of the virtual bus (io/virtual).
//
// Threads: one thread at a time, except counters() and fault(), which any thread may call. Nothing blocks but
// open() and settle().

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
  empty,  ///< nothing there now
  lost,   ///< the bus is gone for now (interface down or deleted, hub closed)
};

/// What an injection of faults did to frames (io/virtual/faults.hpp); a real bus has none.
struct InjectedFaults {
  std::uint64_t dropped_tx = 0;  ///< frames this station sent that never were on the bus
  std::uint64_t dropped_rx = 0;  ///< the same of other stations' frames
  std::uint64_t corrupted = 0;
  std::uint64_t delayed = 0;
};

struct BusCounters {
  std::uint64_t dropped =
      0;  ///< frames that this station (or, for a hub, one of its clients) was too slow to take
  std::uint64_t malformed = 0;  ///< packets that were no frame
  std::uint64_t reopened = 0;   ///< times the bus came back after it was lost
  InjectedFaults injected;
};

/// What settle() found.
struct SettleResult {
  enum class Status : std::uint8_t {
    settled,
    clients_missing,  ///< fewer stations connected than expected; `client` says how many
    client_hung,      ///< no acknowledgement within the limit
    client_died,      ///< its connection closed
    not_quiescent,    ///< stations kept answering each other without end
  };
  Status status = Status::settled;
  std::string client;  ///< the name of the station at fault
  bool settled() const noexcept { return status == Status::settled; }
};

class Bus {
 public:
  virtual ~Bus() = default;

  /// The name of the interface or bus as it stands in logs: "vcan0", "car".
  virtual const std::string& name() const noexcept = 0;
  /// For messages and reports: "SocketCAN interface vcan0".
  virtual std::string description() const = 0;

  /// Throws DeviceError, also when this bus can not be paced as asked. `clock` outlives the bus.
  virtual void open(const RunClock& clock, Pacing pacing) = 0;
  virtual void close() noexcept = 0;

  /// Why the open bus can not carry FD frames, and what to do, as a clause. Empty: it can carry them.
  virtual std::string fd_problem() const { return {}; }

  /// Readable when receive() has something to do; -1 while there is none. It can change at every call of
  /// receive(). A frame of our own may wait without it: after send(), call receive() until it says empty
  /// before waiting here.
  virtual int fd() const noexcept = 0;

  /// Never blocks.
  virtual SendResult send(const Frame& frame) noexcept = 0;
  /// Why the last send() gave SendResult::error: the system's error number (ENETDOWN: the bus is lost).
  virtual int send_error() const noexcept = 0;
  /// Never blocks. Own frames come back with Direction::tx, at their place in the order of the bus. A lost
  /// bus is opened again in here when it is back, tried every 20 ms.
  virtual ReceiveResult receive(Frame& frame) noexcept = 0;

  /// What receive() delivers from now on; empty: every frame.
  virtual void set_filters(std::span<const can_filter> filters) = 0;

  /// Lock-step only: moves every station to run time `now_ns`, delivers all that was sent, and returns when
  /// every station waits and no frame is under way, or when a wall-clock limit has passed. Misuse (asserts):
  /// pacing is not lockstep.
  virtual SettleResult settle(RunTimeNs now_ns) = 0;

  virtual BusCounters counters() const noexcept = 0;
  /// Why the bus is lost, in words; empty: it is not.
  virtual std::string fault() const = 0;
};

}  // namespace hil::io::can
