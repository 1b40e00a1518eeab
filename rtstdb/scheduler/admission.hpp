#pragma once
// Admission control: decides about each transaction that is handed over whether it waits for its turn or ends
// at once.
//
// A firm transaction whose deadline has passed is missed. One whose predicted end lies behind its deadline is
// refused, and so is one that would break what was promised to another firm transaction of its importance.
// The predicted end is: now, what is left of the runs in execution, the promised costs of all that go before
// it, its own, and the budgets of reserved transactions that may still come before. A refusal names the
// earliest deadline that would be admitted.
//
// Nothing is predicted under a virtual clock, nor where a kind of work in the transaction has too few
// measurements. Since refused work gives no measurements, a prediction that is too high could refuse for
// ever: so after a number of consecutive refusals one transaction is admitted without a promise.
//
// Threads: the thread that holds the engine's lock. No function allocates.

#include <cstdint>
#include <optional>

#include <rtstdb/time.hpp>

#include "rtstdb/scheduler/cost_model.hpp"
#include "rtstdb/scheduler/preemption.hpp"
#include "rtstdb/scheduler/ready_queue.hpp"
#include "rtstdb/scheduler/reservations.hpp"

namespace rtstdb::scheduler {

/// What admission decides by; all of it outlives the Admission.
struct AdmissionParts {
  const CostModel& costs;
  const ReadyQueue& queue;
  Reservations& reservations;
  const Preemption& preemption;
  const Clock& clock;
};

class Admission {
 public:
  /// `chunk`: see DatabaseOptions. `read_only`: transactions that write are refused.
  Admission(const AdmissionParts& parts, Nanoseconds chunk, bool read_only) noexcept
      : parts_(parts), chunk_(chunk), read_only_(read_only) {}

  /// None: the transaction is admitted, and the members of ScheduledTransaction that admission sets are set.
  /// Else the status with which it ends; its outcome says why.
  std::optional<Status> decide(ScheduledTransaction& transaction) noexcept;

 private:
  std::optional<Status> decide_by_cost(ScheduledTransaction& transaction, ClockTime now) noexcept;
  void predict(ScheduledTransaction& transaction) const noexcept;
  /// When the transaction would end with this deadline, if nothing else came.
  ClockTime expected_end(ClockTime now, const ScheduledTransaction& transaction,
                         ClockTime deadline) const noexcept;
  /// What is left of the runs in execution before the transaction's turn.
  Nanoseconds remaining_before(ClockTime now, const ScheduledTransaction& transaction,
                               ClockTime deadline) const noexcept;
  /// Whether the costs of all that go before the transaction are known.
  bool all_known_before(const ScheduledTransaction& transaction, ClockTime deadline) const noexcept;
  /// Visits the transactions with a promise that the transaction would go before.
  template <class Each>
  void for_each_lower_priority(const ScheduledTransaction& transaction, ClockTime deadline,
                               Each each) const noexcept;
  /// The earliest deadline of those of its importance whose promise the transaction would break; none: it
  /// breaks none.
  std::optional<ClockTime> first_broken(const ScheduledTransaction& transaction,
                                        ClockTime deadline) const noexcept;
  /// The earliest deadline, not before its own, with which the transaction is admitted when it is submitted
  /// at once.
  ClockTime earliest_feasible(ClockTime now, const ScheduledTransaction& transaction) const noexcept;

  const AdmissionParts parts_;
  const Nanoseconds chunk_;
  const bool read_only_;
  std::uint64_t arrivals_ = 0;
  std::uint32_t refused_in_a_row_ = 0;
};

}  // namespace rtstdb::scheduler
