#pragma once
// Time of the database kept free for one kind of work: so often, done so soon after it is submitted, costing so much at
// most. Made by Database::reserve when the run is configured, and refused there when it and those that were made before
// can not all be kept; named by Terms::reservation. It is given back by its destructor.
//
// What is promised. A transaction that names a reservation is due its `deadline` after it was submitted, and goes before
// all that name none, whatever their importance; among reserved ones the one that is due first. It keeps to its
// reservation when it comes within the period, costs no more than the budget, and writes and asks in one only where that
// was declared. As long as all do, all are done by when they are due, but for what the operating system takes, and for
// pieces of other work that take longer than was measured when the reservation was made.
//
// What does not keep to it is counted and waits for those that do:
//   too often   the deadlines of a reservation's transactions are one period apart. One may come early by less than half a
//               period, and is due as if it had not. One that comes earlier has the rank of its own terms.
//   too long    from the first gap on in which it has cost more than its budget it has the rank of its own terms.
//   not as declared   it writes and asks: it has the rank of its own terms.
//
// Threads: a reservation is made and given back in setup; counts by any. It must not outlive its database, nor end while a
// transaction that names it is pending (misuse).

#include <cstdint>
#include <string>

#include <rtstdb/time.hpp>

namespace rtstdb {

struct ReservationOptions {
  std::string name{};       ///< shown in refusals and reports
  Nanoseconds period{0};    ///< above zero
  Nanoseconds deadline{0};  ///< from submitted to published; above zero, may be longer than the period
  Nanoseconds budget{0};    ///< of Outcome::actual_cost; above zero, at most the deadline
  /// Its transactions write and ask in one. Nobody else can write before such a one is done, and it is not interrupted: its
  /// budget is counted as one piece.
  bool writes_and_asks = false;
};

/// Each transaction that named the reservation and has its outcome is counted in `transactions`, and in one of the others
/// unless it came to nothing for a reason of its own (conflict, bad input, cancelled, device lost).
struct ReservationCounts {
  ReservationOptions options{};
  std::uint64_t transactions = 0;
  std::uint64_t kept = 0;    ///< done by when they were due
  std::uint64_t broken = 0;  ///< kept to their reservation and were not done by when they were due
  std::uint64_t too_often = 0, too_long = 0, not_as_declared = 0;
  Nanoseconds largest_cost{0};
  Nanoseconds longest_answer{0};  ///< from submitted to published, of those kept or broken
};

class Reservation {
 public:
  virtual ~Reservation() = default;
  virtual const ReservationOptions& options() const noexcept = 0;
  /// Allocates. Each figure as it stands.
  virtual ReservationCounts counts() const = 0;
};

}  // namespace rtstdb
