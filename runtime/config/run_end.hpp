#pragma once
// Times of a scenario that no tick of the run reaches.
//
// Threads: any.

#include <cstdint>
#include <string>
#include <string_view>

namespace hil::config {

/// Why no tick of the run is at or after a time, as the end of an error text that begins with the time:
/// " is not before the end of the run, which takes 2 s; give an earlier time or a longer duration". Empty:
/// there is such a tick, or the run has no known end (`duration_ns` 0). `period_ns`: from one tick to the
/// next, or 0. `last_tick`: names the last tick, before its time.
/// Times and durations are at most 2^62 ns.
std::string reason_without_tick(std::int64_t time_ns, std::int64_t period_ns, std::int64_t duration_ns,
                                std::string_view last_tick = "the last tick of the run, at");

}  // namespace hil::config
