#pragma once
// Finds the inputs of devices that a run lacks, so that a run with a dead device does not pass: groups of
// inputs (a CAN message, a Modbus register) of which no value came, or which were not fresh on more than 5 %
// of the ticks after the first one; and groups with more refused frames than the scenario permits.
//
// A tick counts unless the scenario is the reason for a value to be missing: while a fault that can silence
// the group acts, while the loss of the device is permitted and it is lost, or while a fault of a task lets
// the run skip ticks; and from then on until the group is fresh again, for its time-out at most.
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
  /// The share of ticks, after the first arrival, on which an input may be not fresh.
  static constexpr double max_missing_share = 0.05;

  struct Subject {
    std::string name;              ///< with its noun: "message can.car.BrakeCommand"
    bool has_to_come = true;       ///< false: only its refused frames are judged
    std::int64_t recovery_ns = 0;  ///< within which it is fresh again after what silenced it
    std::uint64_t max_rejected = 0;
  };
  /// What a tick finds of one subject.
  struct State {
    bool is_fresh = false;
    bool is_permitted_loss = false;  ///< its device is lost, which the scenario permits
  };
  struct Figures {
    std::uint64_t ticks = 0;      ///< that count; if a value came, from the first one on
    std::uint64_t not_fresh = 0;  ///< of them
  };

  /// `period_ns`: of the base rate.
  InputWatch(std::vector<Subject> subjects, std::int64_t period_ns);

  // Neither allocates nor blocks.
  /// A fault that can silence the subject acts, or does so no more. `delay_ns`: by which it delays values;
  /// when it has ended, it acts for so long on.
  void set_fault(std::size_t subject, bool active, std::int64_t delay_ns = 0) noexcept;
  /// The same of a fault that makes a task take longer.
  void set_task_fault(bool active) noexcept;
  /// After the inputs of a tick are latched and its faults have begun or ended. `states`: by subject.
  void check(std::int64_t time_ns, std::span<const State> states) noexcept;

  /// A sentence for each reason why the run does not pass. `rejected`: the frames that the device of the
  /// subject has refused.
  std::vector<std::string> failures(std::size_t subject, const io::RejectedFrames& rejected) const;
  Figures figures(std::size_t subject) const noexcept;

 private:
  struct Watched {
    Subject subject;
    std::uint32_t acting_faults = 0;
    std::int64_t ended_delay_ns = 0;                 ///< of faults that have ended since the last check
    std::optional<std::int64_t> delayed_until_ns{};  ///< by faults that have ended
    std::optional<std::int64_t> silenced_ns;         ///< last tick on which it was, if it was not fresh since
    std::optional<std::int64_t> first_ns;            ///< of the first tick on which it was fresh
    std::optional<std::int64_t> missing_ns;  ///< of the first tick that counts as not fresh after that one
    Figures before;                          ///< on the ticks before the first arrival
    Figures after;                           ///< on those from it on
  };

  const std::int64_t period_ns_;
  std::vector<Watched> watched_;
  std::uint32_t acting_task_faults_ = 0;
  std::optional<std::int64_t> last_ns_;  ///< of the last check
};

}  // namespace hil::run
