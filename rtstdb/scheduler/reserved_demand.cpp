#include "rtstdb/scheduler/reserved_demand.hpp"

#include <algorithm>
#include <cstdint>
#include <limits>

namespace rtstdb::scheduler {
namespace {

/// Bounds the computation to a few seconds.
constexpr std::uint64_t max_lengths = 2'000'000;

double ratio(Nanoseconds part, Nanoseconds of) {
  return static_cast<double>(part.count()) / static_cast<double>(of.count());
}

Nanoseconds demanded_within(const Demand& demand, Nanoseconds length) {
  if (length < demand.deadline) return Nanoseconds(0);
  return ((length - demand.deadline) / demand.period + 1) * demand.budget;
}

/// The longest blocking piece: a job whose deadline lies beyond the length may have begun before it.
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
    found.demanded.push_back(demanded_within(demand, length));
  return found;
}

}  // namespace

std::optional<Shortfall> first_shortfall(std::span<const Demand> demands, Nanoseconds piece, double share) {
  double used = 0.0;
  double ahead_ns = 0.0;  // bound on how far the demand exceeds an even use of time
  for (const Demand& demand : demands) {
    const double utilization = ratio(demand.budget, demand.period);
    used += utilization;
    ahead_ns += utilization * std::max(0.0, static_cast<double>((demand.period - demand.deadline).count()));
  }
  if (used >= share) return Shortfall{.kind = Shortfall::Kind::utilization, .utilization = used};
  // For longer lengths the demand is within the share.
  const auto piece_ns = static_cast<double>(piece_before(demands, piece, Nanoseconds(0)).count());
  const double bound_ns = (ahead_ns + piece_ns) / (share - used);
  std::uint64_t lengths = 0;
  for (Nanoseconds length{0};;) {
    length = first_deadline_after(demands, length);
    // Up to the longest deadline, pieces of the reserved jobs themselves block.
    if (static_cast<double>(length.count()) > bound_ns) return std::nullopt;
    if (++lengths > max_lengths) return Shortfall{.kind = Shortfall::Kind::undecided, .utilization = used};
    const Nanoseconds before = piece_before(demands, piece, length);
    Nanoseconds demanded = before;
    for (const Demand& demand : demands)
      demanded += demanded_within(demand, length);
    if (static_cast<double>(demanded.count()) > share * static_cast<double>(length.count()))
      return shortfall_at(demands, length, before);
  }
}

}  // namespace rtstdb::scheduler
