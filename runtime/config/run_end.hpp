#pragma once
// Times of a scenario that no tick of the run reaches.
//
// Threads: any.

#include <cstdint>
#include <string>

namespace hil::config {

/// The end of a sentence that begins with the time, when no tick of the run is at or after it: " is not
/// before the end of the run, which takes 2 s", " is after the last tick of the run, at 1.999 s". Empty:
/// there is such a tick, or the run has no known end (`duration_ns` 0). `period_ns`: from one tick to the
/// next, or 0.
/// Times and durations are at most 2^62 ns.
std::string no_tick_from(std::int64_t time_ns, std::int64_t period_ns, std::int64_t duration_ns);

}  // namespace hil::config
