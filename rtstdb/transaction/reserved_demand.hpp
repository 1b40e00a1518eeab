#pragma once
// Whether reservations can all be kept: for each length of time, what may have to be done within it, earliest deadline
// first, and one piece that was begun before and can not be interrupted, against the share of it that is theirs.
//
// Sporadic tasks by the processor demand criterion (Baruah, Mok, Rosier 1990), with blocking: within a length L all jobs
// with deadlines inside it are asked for, and before them one piece of a job whose deadline lies outside. Setup: allocates.

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <rtstdb/time.hpp>

namespace rtstdb::transaction {

struct Demand {
  Nanoseconds period{0}, deadline{0}, budget{0};
  Nanoseconds piece{0};  ///< so much of it in a row can not be interrupted by the others
};

/// Where more may be asked for than there is.
struct Shortfall {
  enum class Kind : unsigned char {
    within_length,  ///< within `length` from the first of them
    in_the_long_run,
    too_close,  ///< so close to the share that it could not be looked at to the end
  } kind = Kind::within_length;
  Nanoseconds length{0};
  std::vector<Nanoseconds> asked = {};  ///< within_length: by demand
  Nanoseconds piece{0};                 ///< within_length: that goes on when they come
  double share = 0.0;                   ///< of all time, by all: the other kinds
};

/// `piece`: the longest one of all other work. None: all can be kept with `share` of the time, 0 to 1.
std::optional<Shortfall> first_shortfall(std::span<const Demand> demands, Nanoseconds piece, double share);

}  // namespace rtstdb::transaction
