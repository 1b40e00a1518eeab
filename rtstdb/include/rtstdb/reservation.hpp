#pragma once
// A reservation keeps engine time free for one kind of periodic transaction: a sporadic task with a period, a
// relative deadline and a worst-case cost (budget). Database::reserve creates it at setup and refuses it if
// it is not feasible beside the existing ones. Terms::reservation names it. Its destructor releases the time.
//
// Guarantee. A transaction that names a reservation has its deadline `deadline` after it was submitted. It
// has priority over all transactions without a reservation, whatever their importance; among reserved ones
// the earliest deadline goes first. A transaction conforms if it comes no earlier than the period allows,
// costs no more than the budget, and combines writes with queries only if that was declared. If all reserved
// transactions conform, all meet their deadlines, except for delays by the operating system and for pieces of
// other work that take longer than was measured when the reservation was created.
//
// A transaction that does not conform is counted, and waits for those that do:
//   too often         The deadlines of a reservation's transactions are one period apart. A transaction that
//                     comes early by less than half a period keeps the deadline of its period. An earlier one
//                     has the priority of its own Terms.
//   too long          From the first preemption point at which it has cost more than the budget, it has the
//                     priority of its own Terms.
//   undeclared        It combines writes with queries: it has the priority of its own Terms.
//
// Threads: creation and destruction are setup; any thread may call counts. A reservation must not outlive its
// database, and must not be destroyed while a transaction that names it is pending (misuse).

#include <cstdint>
#include <string>

#include <rtstdb/time.hpp>

namespace rtstdb {

struct ReservationOptions {
  std::string name{};       ///< for reports and error texts
  Nanoseconds period{0};    ///< shortest time between two transactions; above zero
  Nanoseconds deadline{0};  ///< from submitted to published; above zero, may be longer than the period
  Nanoseconds budget{0};    ///< largest Outcome::actual_cost; above zero, at most the deadline
  /// Its transactions combine writes with queries. Such a transaction blocks all other writes and is not
  /// preempted, so the feasibility test counts its whole budget as one piece.
  bool writes_and_queries = false;
};

/// `transactions` counts each transaction that named the reservation and has its outcome. It is also counted
/// in one of the other counts, unless it did not complete for a reason of its own (conflict, bad input,
/// cancelled, device lost).
struct ReservationCounts {
  ReservationOptions options{};
  std::uint64_t transactions = 0;
  std::uint64_t kept = 0;    ///< completed by their deadline
  std::uint64_t broken = 0;  ///< conformed and did not complete by their deadline
  std::uint64_t too_often = 0, too_long = 0, undeclared = 0;
  Nanoseconds largest_cost{0};
  Nanoseconds longest_response{0};  ///< longest time from submitted to published, of those kept or broken
};

/// Made by Database::reserve.
class Reservation {
 public:
  virtual ~Reservation() = default;
  virtual const ReservationOptions& options() const noexcept = 0;
  /// Allocates. The counts are read one by one, not at one instant.
  virtual ReservationCounts counts() const = 0;
};

}  // namespace rtstdb
