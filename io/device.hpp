#pragma once
// The port between the runtime and a device outside the run: a CAN bus, a Modbus unit, a simulated
// counterpart. Two more ports may belong to a device: its arrivals (arrival_source.hpp), and the faults
// that act on it (fault_target.hpp).
//
// A device converts bytes to timestamped values and back, in threads of its own. The executive never waits
// for it. Once per tick it latches the newest samples and releases new outputs; both calls are wait-free.
//
// Threads: one ordinary thread makes the setup calls (channels, start, stop). One tick thread calls
// latch_inputs and release_outputs, which must not allocate, block or do I/O. Under the virtual clock alone,
// the tick thread also calls exchange, which may block.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "io/arrival_source.hpp"
#include "io/fault_target.hpp"
#include "io/run_clock.hpp"

namespace hil::io {

enum class Pacing : std::uint8_t {
  realtime,  ///< the device runs concurrently with the tick; exchange is never called
  lockstep,  ///< virtual clock: the device's state changes only inside exchange
};

/// One scalar that crosses the port.
struct ChannelInfo {
  std::string name;  ///< unique within its device, e.g. "BrakeCommand.Deceleration"
  std::string unit;  ///< as in the device's description; empty: dimensionless
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  double safe_value = 0.0;  ///< what an input reads before its first sample and after the device is lost;
                            ///< what an output is set to by enter_safe_state
};

/// The newest value of an input. `time_ns` is the arrival time of the bytes (the kernel's timestamp if there
/// is one).
struct Sample {
  double value = 0.0;
  RunTimeNs time_ns = std::numeric_limits<RunTimeNs>::min();
  bool fresh = false;  ///< false: nothing received yet, or the device is lost; `value` is then the safe value
};

/// When an output is sent: with each release of outputs, or in frames that are due at offset_ns + n *
/// period_ns, each sent with the first release at or after its due time.
struct SendCycle {
  RunTimeNs period_ns = 0;  ///< 0: with each release
  RunTimeNs offset_ns = 0;  ///< run time at which the first frame is due

  /// Whether a frame is sent with the release at `tick_ns`. `last_ns`: time of the release before; the lowest
  /// RunTimeNs before the first release.
  bool is_due(RunTimeNs last_ns, RunTimeNs tick_ns) const noexcept {
    return period_ns <= 0 || frames_up_to(tick_ns) > frames_up_to(last_ns);
  }

 private:
  RunTimeNs frames_up_to(RunTimeNs time_ns) const noexcept {
    return time_ns < offset_ns ? 0 : (time_ns - offset_ns) / period_ns + 1;
  }
};

/// Inputs that arrive together: the signals of a CAN message, or one Modbus register.
struct InputGroup {
  std::string name;       ///< unique within its device: "BrakeCommand", "light_ego"
  std::size_t first = 0;  ///< index into inputs()
  std::size_t count = 0;  ///< at least 1
  /// An input of the group that has had no new value for longer than this is not fresh; 0: no limit.
  RunTimeNs timeout_ns = 0;
  bool can_reject = false;  ///< the device checks its frames and counts those that it rejects
};

/// Frames of an input group that a device rejected.
struct RejectedFrames {
  std::uint64_t count = 0;
  /// Those of them that the scenario made: the device would have accepted the frame as it was sent, after all
  /// frames as they were sent. A new pass of a log, or a program after an interruption, begins a new counter.
  std::uint64_t by_scenario = 0;
};

/// An event concerning a device's values, as a sentence for the report.
struct DeviceEvent {
  RunTimeNs time_ns = 0;  ///< may lie before the first tick
  std::string text;
  bool is_expected = false;  ///< the scenario causes it; logged as info, others as a warning
};

/// Thrown by start: the device can not be used (interface missing, port in use, permission). The message
/// names the device, what was tried, the system's error and what the user can do.
class DeviceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Device {
 public:
  virtual ~Device() = default;

  virtual const std::string& name() const noexcept = 0;
  /// Device to run. The order is fixed at construction; latch_inputs uses it.
  virtual std::span<const ChannelInfo> inputs() const noexcept = 0;
  /// Groups of inputs that the remote side sends together. An input may belong to no group. Fixed at
  /// construction.
  virtual std::span<const InputGroup> input_groups() const noexcept = 0;
  /// The device counts as lost when connected() is false for longer than this; 0: never.
  virtual RunTimeNs loss_timeout_ns() const noexcept = 0;
  /// Run to device. The order is fixed at construction; release_outputs uses it.
  virtual std::span<const ChannelInfo> outputs() const noexcept = 0;

  /// When this output is sent. `output` is below outputs().size(). Fixed at construction; setup thread.
  virtual SendCycle send_cycle(std::size_t output) const noexcept {
    static_cast<void>(output);
    return {};
  }

  /// Opens the device and starts its threads. Throws DeviceError. `clock` outlives the device.
  virtual void start(const RunClock& clock, Pacing pacing) = 0;

  /// Copies the newest sample of every input. `samples.size() == inputs().size()`.
  virtual void latch_inputs(std::span<Sample> samples) noexcept = 0;

  /// The rejected frames of an input group since the start. Any thread.
  virtual RejectedFrames rejected(std::size_t group) const noexcept {
    static_cast<void>(group);
    return {};
  }

  /// Hands the outputs of this tick to the device's thread. `values.size() == outputs().size()`. A full queue
  /// drops these outputs and counts them.
  virtual void release_outputs(std::span<const double> values, RunTimeNs tick_ns) noexcept = 0;

  /// Virtual clock only: sends everything released so far and returns when every reply has arrived and the
  /// remote side is idle. False: the remote side exceeded its wall-clock limit; fault() says which one.
  virtual bool exchange(RunTimeNs tick_ns) = 0;

  /// Ends all faults, and sends every output's safe value once, as soon as the device's thread can. What
  /// arrives after that is not kept for next_arrival. Any thread.
  virtual void enter_safe_state() noexcept = 0;

  /// Stops the threads and closes the device. Sends what was released before, within a bounded time.
  /// Idempotent.
  virtual void stop() noexcept = 0;

  /// Whether the remote side is reachable. CAN: the interface is up and its controller is not bus-off. Modbus
  /// client: the unit has accepted the connection and answered all requests of the last cycle. Modbus server:
  /// a client is connected. Also false while the device's own thread makes no progress. Any thread; never
  /// blocks.
  virtual bool connected() const noexcept = 0;
  /// Whether the remote side has responded since the start. Modbus client: the unit has answered a request.
  /// Any thread; never blocks.
  virtual bool has_answered() const noexcept { return connected(); }
  /// The first fault of the device, as one sentence for the user. Empty: none. Any ordinary thread.
  virtual std::string fault() const = 0;
  /// Why due outputs could not be sent, as one sentence; the first such reason. A queue that is full for a
  /// moment does not count. Empty: none. Any ordinary thread.
  virtual std::string send_fault() const = 0;

  /// Every arrival of its inputs. Null: the device keeps none.
  virtual ArrivalSource* arrival_source() noexcept { return nullptr; }
  /// What faults of the run act on. Null: the device has no faults.
  virtual FaultTarget* fault_target() noexcept { return nullptr; }

  /// The events from number `first` on, in the order in which they were found. Any ordinary thread.
  virtual std::vector<DeviceEvent> events_since(std::size_t first) const {
    static_cast<void>(first);
    return {};
  }
};

/// The index of the output with this name; the number of outputs: there is none.
inline std::size_t output_index(const Device& device, const std::string& name) {
  std::size_t index = 0;
  for (const ChannelInfo& output : device.outputs()) {
    if (output.name == name) break;
    ++index;
  }
  return index;
}

}  // namespace hil::io
