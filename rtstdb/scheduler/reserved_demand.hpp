#pragma once
// Feasibility of reservations: sporadic tasks, earliest deadline first, by the processor demand criterion
// (Baruah, Mok, Rosier 1990) with blocking. For each length of time, the jobs with deadlines inside it and
// one piece of a job with a deadline beyond it, which was begun before and can not be preempted, must fit
// into the share that is reserved.
//
// Threads: any. Setup: allocates.

#include <optional>
#include <span>
#include <vector>

#include <rtstdb/time.hpp>

namespace rtstdb::scheduler {

struct Demand {
  Nanoseconds period{0}, deadline{0}, budget{0};
  Nanoseconds piece{0};  ///< the longest part of the budget that the others can not preempt
};

/// Why the reservations can not all be kept.
struct Shortfall {
  enum class Kind : unsigned char {
    within_length,  ///< within `length` of time more can be demanded than the share of it
    utilization,    ///< their utilization is not below the share
    undecided,      ///< their utilization is so close to the share that the check does not come to an end
  } kind = Kind::within_length;
  Nanoseconds length{0};
  std::vector<Nanoseconds> demanded = {};  ///< within_length: of each demand
  Nanoseconds piece{0};                    ///< within_length: the piece that blocks them
  double utilization = 0.0;                ///< the other kinds: of all demands together
};

/// `piece`: the longest one of all other work; `share`: of the time, 0 to 1. None: all reservations can be
/// kept.
std::optional<Shortfall> first_shortfall(std::span<const Demand> demands, Nanoseconds piece, double share);

}  // namespace rtstdb::scheduler
