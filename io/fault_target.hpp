#pragma once
// The port to a device on which faults of the run act. What a fault does is a matter between the device and
// its type of bus, which adds it before the start; the first fault has the number 0.
//
// Threads: silences on the setup thread; set_fault on the tick thread, without allocation; set_away as
// Device::exchange; the rest on any thread, and none blocks.

#include <cstddef>
#include <cstdint>
#include <optional>

namespace hil::io {

class FaultTarget {
 public:
  virtual ~FaultTarget() = default;

  /// Begins or ends a fault. It acts on what the device sends from now on and, in real time within the time
  /// that its thread takes to wake, on what it receives.
  virtual void set_fault(std::size_t number, bool active) noexcept = 0;
  /// Whether a fault of the device keeps its inputs from being fresh while it acts.
  virtual bool silences(std::size_t number) const noexcept = 0;
  /// The frames or requests that came while the fault was active.
  virtual std::uint64_t fault_count(std::size_t number) const noexcept = 0;
  /// Frames, requests and connections on which the fault acted: it changed, dropped, repeated or delayed
  /// them, left them without an answer, or cut them. A delayed request counts when its delay begins.
  virtual std::uint64_t fault_effects(std::size_t number) const noexcept = 0;
  /// The fault that let none of the frames through that this one would have changed; empty: there is none.
  virtual std::optional<std::size_t> fault_stopped_by(std::size_t number) const noexcept {
    static_cast<void>(number);
    return std::nullopt;
  }

  /// How often a fault has dropped, held or changed a frame of an input group, or made the device reject it.
  /// Frames that the device would reject without faults do not count.
  virtual std::uint64_t faulted_frames(std::size_t group) const noexcept {
    static_cast<void>(group);
    return 0;
  }
  /// Those of them that had a value of this input, which belongs to a group.
  virtual std::uint64_t faulted_values(std::size_t input) const noexcept {
    static_cast<void>(input);
    return 0;
  }

  /// A fault of the scenario pauses or ends a program behind the device, or lets it go on: the first frame of
  /// a message from now on need not continue those before.
  virtual void note_interruption() noexcept {}
  /// In lock-step, before an exchange: while `away`, the exchange does not wait for programs of this process
  /// group, which are paused or have ended because the run wants it.
  virtual void set_away(int process_group, bool away) {
    static_cast<void>(process_group), static_cast<void>(away);
  }
};

}  // namespace hil::io
