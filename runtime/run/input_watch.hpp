#pragma once
// Finds the inputs of devices that a run lacks, so that a run with a dead device does not pass: groups of
// inputs (a CAN message, a Modbus register), and signals of groups, of which no value came, or which were not
// fresh on more than config::max_missing_share of the ticks after the first one; and groups with more
// rejected frames than the scenario permits.
//
// A tick does not count while the scenario is the reason that the value may be missing:
// - A fault that silences the device is active, or a fault of a task makes the run skip ticks, and the value
//   was fresh when that began.
// - A fault has just taken a frame with the value, which shows that the device sends it.
// - The device is lost, and may be.
// - After these, until a value comes. Without a fault the device has one time-out for that, over
//   all such times together; then the ticks count until one has come.
// Ticks before the first value, or before the first frame that a fault took, count only if neither comes.
//
// Threads: set_fault, set_task_fault and check from the base thread; failures and figures after the run.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "io/device.hpp"

namespace hil::run {

class InputWatch {
 public:
  struct InputRule {
    std::string name;              ///< with its noun: "message can.car.BrakeCommand"
    bool has_to_come = true;       ///< false: only its rejected frames are judged
    std::int64_t recovery_ns = 0;  ///< within which it is fresh again after a fault
    std::uint64_t max_rejected = 0;
    /// Of a signal: the place of its group among the rules. It is judged where the group has come.
    std::optional<std::size_t> group{};
  };
  /// The state of an input on a tick.
  struct State {
    bool is_fresh = false;
    bool has_come = false;           ///< a value since the tick before, which is fresh
    bool is_faulted = false;         ///< a fault has taken a value of it since the tick before
    bool is_permitted_loss = false;  ///< its device is lost, which the scenario permits
  };
  struct Figures {
    std::uint64_t ticks = 0;      ///< that count
    std::uint64_t not_fresh = 0;  ///< of them
  };

  /// `period_ns`: of the base rate.
  InputWatch(std::vector<InputRule> rules, std::int64_t period_ns);

  // Neither allocates nor blocks.
  /// A fault that silences the input's device begins or ends.
  void set_fault(std::size_t input, bool active) noexcept;
  /// A fault that makes a task take longer begins or ends.
  void set_task_fault(bool active) noexcept;
  /// After the inputs of a tick are latched and its faults have begun or ended. `states`: by rule.
  void check(std::int64_t time_ns, std::span<const State> states) noexcept;

  /// A sentence for each reason why the run does not pass. `rejected`: the frames of the group that its
  /// device has rejected; of a signal, none.
  std::vector<std::string> failures(std::size_t input, const io::RejectedFrames& rejected) const;
  Figures figures(std::size_t input) const noexcept;

 private:
  bool is_missing(std::size_t input) const noexcept;

  struct InputState {
    InputRule rule;
    std::uint32_t active_faults = 0;
    bool is_excused = false;     ///< the scenario is why it may be missing
    std::int64_t silent_ns = 0;  ///< time that it was not fresh without a fault, since the last sign of life
    bool was_fresh = true;       ///< on the tick before; true before the first one
    bool was_sent = false;       ///< a value came, or a frame that a fault took
    bool was_received = false;   ///< a value came
    std::optional<std::int64_t> missing_ns;  ///< of the first tick that counts as not fresh since was_sent
    Figures before;                          ///< on the ticks before was_sent
    Figures after;                           ///< on the others
  };

  const std::int64_t period_ns_;
  std::vector<InputState> inputs_;
  std::uint32_t active_task_faults_ = 0;
  std::optional<std::int64_t> last_ns_;  ///< of the last check
};

}  // namespace hil::run
