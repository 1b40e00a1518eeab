#pragma once
// Finds the inputs of devices that a run lacks, so that a run with a dead device does not pass: groups of
// inputs (a CAN message, a Modbus register) of which no value came, or which were not fresh on more than 5 %
// of the ticks after the first one; and groups with more refused frames than the scenario permits.
//
// A tick counts unless the scenario silences the group: a fault of its device acts, a fault of the message
// acted on one of its frames, its device is lost and may be, or a fault of a task lets the run skip ticks;
// and unless it is after such a tick, the group has not been fresh since, and no more than its time-out has
// passed. Ticks before the first value, or the first frame on which a fault acts, count only if there is
// none.
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
    bool is_faulted = false;         ///< a fault of the message has acted on a frame since the tick before
    bool is_permitted_loss = false;  ///< its device is lost, which the scenario permits
  };
  struct Figures {
    std::uint64_t ticks = 0;      ///< that count
    std::uint64_t not_fresh = 0;  ///< of them
  };

  /// `period_ns`: of the base rate.
  InputWatch(std::vector<Subject> subjects, std::int64_t period_ns);

  // Neither allocates nor blocks.
  /// A fault of the subject's device acts, or does so no more.
  void set_fault(std::size_t subject, bool active) noexcept;
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
    std::optional<std::int64_t> silenced_ns;  ///< last tick on which it was, if it was not fresh since
    bool has_sent = false;                    ///< a value came, or a frame on which a fault acted
    bool has_come = false;                    ///< a value came
    std::optional<std::int64_t> missing_ns;   ///< of the first tick that counts as not fresh once it has sent
    Figures before;                           ///< on the ticks before it has sent
    Figures after;                            ///< on the others
  };

  const std::int64_t period_ns_;
  std::vector<Watched> watched_;
  std::uint32_t acting_task_faults_ = 0;
  std::optional<std::int64_t> last_ns_;  ///< of the last check
};

}  // namespace hil::run
