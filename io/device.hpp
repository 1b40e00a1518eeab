#pragma once
// The port between the executive and anything outside the process: a CAN bus, a Modbus unit, a simulated
// twin.
//
// A device turns bytes into timestamped values and values into bytes, in threads of its own. The executive
// never waits for it: once per tick it latches the newest samples and releases new outputs, both wait-free.
//
// Threads: configure-time calls (channels, start, stop) come from one ordinary thread. latch_inputs and
// release_outputs come from one tick thread and must not allocate, block or do I/O. exchange is called only
// under the virtual clock, from the tick thread, and may block.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace hil::io {

/// Nanoseconds since the run's first tick. Negative before it.
using RunTimeNs = std::int64_t;

/// The time base that devices stamp their samples with. It never goes back.
class RunClock {
 public:
  virtual ~RunClock() = default;
  /// While nobody knows yet when the first tick will be, a distant past that moves on; then it leaps forward.
  virtual RunTimeNs now_ns() const noexcept = 0;
  /// When in the run a stamp of now_ns() was taken: once the first tick is known, also of one from before the
  /// leap. Other times are handed back as they are.
  virtual RunTimeNs settled(RunTimeNs stamp_ns) const noexcept { return stamp_ns; }
};

enum class Pacing : std::uint8_t {
  realtime,  ///< the device runs beside the tick; exchange is never called
  lockstep,  ///< virtual clock: nothing moves between two calls of exchange
};

/// One scalar that crosses the port.
struct ChannelInfo {
  std::string name;  ///< unique within its device, e.g. "BrakeCommand.Deceleration"
  std::string unit;  ///< as written by the device's description; empty: dimensionless
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  double safe_value = 0.0;  ///< what an input reads before its first sample and after the device is lost;
                            ///< what an output is set to by enter_safe_state
};

/// The newest value of an input. `time_ns` is when the bytes arrived (kernel timestamp where there is one).
struct Sample {
  double value = 0.0;
  RunTimeNs time_ns = std::numeric_limits<RunTimeNs>::min();
  bool fresh = false;  ///< false: nothing received yet, or the device is lost; `value` is then the safe value
};

/// Inputs that arrive together: the signals of a CAN message, or one Modbus register.
struct InputGroup {
  std::string name;       ///< unique within its device: "BrakeCommand", "light_ego"
  std::size_t first = 0;  ///< index into inputs()
  std::size_t count = 0;  ///< at least 1
  /// An input of the group that has had no new value for longer than this is not fresh; 0: no limit.
  RunTimeNs timeout_ns = 0;
};

/// Something that happened to the values of a device, as a sentence for the report.
struct DeviceEvent {
  RunTimeNs time_ns = 0;  ///< may lie before the first tick
  std::string text;
};

/// Thrown by start: the device can not be had (interface missing, port in use, permission). The message is a
/// sentence that names the device, what was tried, the system's answer and what the user can do.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Device {
 public:
  virtual ~Device() = default;

  virtual const std::string& name() const noexcept = 0;
  /// Device -> run. Order is fixed from construction on; latch_inputs follows it.
  virtual std::span<const ChannelInfo> inputs() const noexcept = 0;
  /// The groups of the inputs that the other side sends; an input may be in none. Fixed from construction on.
  virtual std::span<const InputGroup> input_groups() const noexcept = 0;
  /// How long connected() may be false before the device counts as lost; 0: it never does.
  virtual RunTimeNs loss_timeout_ns() const noexcept = 0;
  /// Run -> device. Order is fixed from construction on; release_outputs follows it.
  virtual std::span<const ChannelInfo> outputs() const noexcept = 0;

  /// Opens the device and starts its threads. Throws DeviceError. `clock` outlives the device.
  virtual void start(const RunClock& clock, Pacing pacing) = 0;

  /// Copies the newest sample of every input. `samples.size() == inputs().size()`.
  virtual void latch_inputs(std::span<Sample> samples) noexcept = 0;

  /// Before start: from now on every sample of this input is kept for next_arrival too, since latch_inputs
  /// shows only the newest of those that come within one tick. False: this device knows the newest only.
  virtual bool keep_arrivals(std::size_t input) {
    static_cast<void>(input);
    return false;
  }
  /// Takes the oldest kept sample of this input; false when none is left. Thread rule of latch_inputs.
  virtual bool next_arrival(std::size_t input, Sample& sample) noexcept {
    static_cast<void>(input), static_cast<void>(sample);
    return false;
  }
  /// Kept samples of all inputs that were lost since nobody took the older ones in time. Any thread.
  virtual std::uint64_t lost_arrivals() const noexcept { return 0; }

  /// Hands the outputs of this tick to the device's thread. `values.size() == outputs().size()`. A full
  /// hand-over queue drops the newest and counts it.
  virtual void release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept = 0;

  /// Virtual clock only: returns when everything released so far has been sent, every answer to it has
  /// arrived, and the other side waits. False: the other side did not answer within its wall-clock limit
  /// (fault() says which).
  virtual bool exchange(RunTimeNs tick_ns) = 0;

  /// Sends every output's safe value once, as soon as the device's thread can. Any thread.
  virtual void enter_safe_state() noexcept = 0;

  /// Stops the threads and closes the device. Idempotent. What was released before is sent first (bounded
  /// wait).
  virtual void stop() noexcept = 0;

  /// Whether the other side can be reached: the interface of a CAN bus is up and its controller not bus-off;
  /// a Modbus unit has accepted the connection and answered all requests of the last cycle; a Modbus server
  /// has a client. False, too, while the device's own thread makes no progress. Any thread; never blocks.
  virtual bool connected() const noexcept = 0;
  /// Whether the other side has shown since the start that it is there. A Modbus unit: it has answered a
  /// request. Any thread; never blocks.
  virtual bool has_answered() const noexcept { return connected(); }
  /// What is wrong with the device, in one sentence for the user. Empty: nothing. Any ordinary thread.
  virtual std::string fault() const = 0;
  /// The first reason why outputs that were due could not be sent, in one sentence. A queue that was full for
  /// a moment is no such reason. Empty: there was none. Any ordinary thread.
  virtual std::string send_fault() const = 0;

  /// The events from number `first` on, in the order they were found; empty: there are none. Any ordinary
  /// thread.
  virtual std::vector<DeviceEvent> events_since(std::size_t first) const {
    static_cast<void>(first);
    return {};
  }
};

}  // namespace hil::io
