#pragma once
// What modules contribute to the report of a run.
//
// Threads: plain data, filled after the last tick.

#include <cstdint>
#include <string>
#include <vector>

#include "runtime/contribution/map.hpp"
#include "runtime/contribution/section.hpp"

namespace hil::contribution {

/// Something that happened at one instant: a light changed, braking began.
struct Event {
  std::int64_t time_ns = 0;
  std::string text;
};

struct Contribution {
  std::int64_t end_ns = 0;  ///< run time at which the run ended: the instant that the map shows
  std::vector<Event> events;
  Map map;
  std::vector<Section> sections;
};

}  // namespace hil::contribution
