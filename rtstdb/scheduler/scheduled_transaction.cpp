#include "rtstdb/scheduler/scheduled_transaction.hpp"

#include <algorithm>

#include "rtstdb/scheduler/reservations.hpp"

namespace rtstdb::scheduler {

ReservationImpl* ScheduledTransaction::reservation() const noexcept {
  return static_cast<ReservationImpl*>(terms_.reservation);
}

void ScheduledTransaction::note_lateness(ClockTime now) noexcept {
  // Unsigned: a deadline may lie before the epoch of every clock.
  const auto late_ns = static_cast<std::uint64_t>(now.time_since_epoch().count()) -
                       static_cast<std::uint64_t>(terms_.deadline.time_since_epoch().count());
  constexpr auto longest_ns = static_cast<std::uint64_t>(Nanoseconds::max().count());
  outcome_.lateness = Nanoseconds(static_cast<std::int64_t>(std::min(late_ns, longest_ns)));
}

}  // namespace rtstdb::scheduler
