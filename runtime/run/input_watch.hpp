#pragma once
// Finds the inputs of devices that a run lacks, so that a run with a dead device does not pass: groups of
// inputs (a CAN message, a Modbus register) of which no value came, or which were not fresh on more than
// config::max_missing_share of the ticks after the first one; and groups with more rejected frames than the
// scenario permits.
//
// A tick counts for a group unless the scenario is the reason that its value may be missing: a fault of its
// device is active, a fault of the message acted on one of its frames, its device is lost and may be lost, or
// a fault of a task makes the run skip ticks. After such a tick no tick counts until the group is fresh
// again, for one time-out at most. Ticks before the first value, or before the first frame on which a fault
// acted, count only if neither comes.
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
  struct InputGroupRule {
    std::string name;              ///< with its noun: "message can.car.BrakeCommand"
    bool has_to_come = true;       ///< false: only its rejected frames are judged
    std::int64_t recovery_ns = 0;  ///< within which it is fresh again after an excused tick
    std::uint64_t max_rejected = 0;
  };
  /// The state of a group on a tick.
  struct State {
    bool is_fresh = false;
    bool is_faulted = false;         ///< a fault of the message has acted on a frame since the tick before
    bool is_permitted_loss = false;  ///< its device is lost, which the scenario permits
  };
  struct Figures {
    std::uint64_t ticks = 0;      ///< that count
    std::uint64_t not_fresh = 0;  ///< of them
  };

  /// `period_ns`: of the base rate.
  InputWatch(std::vector<InputGroupRule> rules, std::int64_t period_ns);

  // Neither allocates nor blocks.
  /// A fault of the group's device begins or ends.
  void set_fault(std::size_t group, bool active) noexcept;
  /// A fault that makes a task take longer begins or ends.
  void set_task_fault(bool active) noexcept;
  /// After the inputs of a tick are latched and its faults have begun or ended. `states`: by group.
  void check(std::int64_t time_ns, std::span<const State> states) noexcept;

  /// A sentence for each reason why the run does not pass. `rejected`: the frames of the
  /// group that its device has rejected.
  std::vector<std::string> failures(std::size_t group, const io::RejectedFrames& rejected) const;
  Figures figures(std::size_t group) const noexcept;

 private:
  struct InputState {
    InputGroupRule rule;
    std::uint32_t active_faults = 0;
    std::optional<std::int64_t> excused_ns;  ///< last excused tick, if it was not fresh since
    bool was_sent = false;                   ///< a value came, or a frame on which a fault acted
    bool was_received = false;               ///< a value came
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
