#include "rtstdb/transaction/reserved_demand.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace rtstdb::transaction {
namespace {

/// Lengths that are looked at; a few seconds at the most.
constexpr std::uint64_t max_lengths = 2'000'000;

double ratio(Nanoseconds part, Nanoseconds of) {
  return static_cast<double>(part.count()) / static_cast<double>(of.count());
}

Nanoseconds asked_within(const Demand& demand, Nanoseconds length) {
  if (length < demand.deadline) return Nanoseconds(0);
  return ((length - demand.deadline) / demand.period + 1) * demand.budget;
}

/// A job whose deadline lies behind the length may have begun before it.
Nanoseconds piece_before(std::span<const Demand> demands, Nanoseconds piece, Nanoseconds length) {
  for (const Demand& demand : demands) {
    if (demand.deadline > length) piece = std::max(piece, demand.piece);
  }
  return piece;
}

Nanoseconds first_deadline_after(std::span<const Demand> demands, Nanoseconds length) {
  Nanoseconds first = Nanoseconds::max();
  for (const Demand& demand : demands) {
    const bool none_yet = length < demand.deadline;
    first = std::min(
        first, none_yet ? demand.deadline
                        : demand.deadline + ((length - demand.deadline) / demand.period + 1) * demand.period);
  }
  return first;
}

Shortfall shortfall_at(std::span<const Demand> demands, Nanoseconds length, Nanoseconds piece) {
  Shortfall found{.length = length, .piece = piece};
  for (const Demand& demand : demands)
    found.asked.push_back(asked_within(demand, length));
  return found;
}

}  // namespace

std::optional<Shortfall> first_shortfall(std::span<const Demand> demands, Nanoseconds piece, double share) {
  double used = 0.0;
  double ahead_ns = 0.0;  // of what they would take at an even pace, at most
  for (const Demand& demand : demands) {
    const double one = ratio(demand.budget, demand.period);
    used += one;
    ahead_ns += one * std::max(0.0, static_cast<double>((demand.period - demand.deadline).count()));
  }
  if (used >= share) return Shortfall{.kind = Shortfall::Kind::in_the_long_run, .share = used};
  // From here on no more is asked for than even pace and piece bring.
  const auto piece_ns = static_cast<double>(piece_before(demands, piece, Nanoseconds(0)).count());
  const double enough_ns = (ahead_ns + piece_ns) / (share - used);
  std::uint64_t lengths = 0;
  for (Nanoseconds length{0};;) {
    length = first_deadline_after(demands, length);
    // Up to the longest deadline pieces of the reserved ones themselves count.
    if (static_cast<double>(length.count()) > enough_ns) return std::nullopt;
    if (++lengths > max_lengths) return Shortfall{.kind = Shortfall::Kind::too_close, .share = used};
    const Nanoseconds before = piece_before(demands, piece, length);
    Nanoseconds asked = before;
    for (const Demand& demand : demands)
      asked += asked_within(demand, length);
    if (static_cast<double>(asked.count()) > share * static_cast<double>(length.count()))
      return shortfall_at(demands, length, before);
  }
}

}  // namespace rtstdb::transaction
