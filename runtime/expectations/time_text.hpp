#pragma once
// Instants, durations and counts in the sentences of results, in ASCII.

#include <cstdint>
#include <string>

#include "runtime/report/quantities.hpp"

namespace hil::expectations {

/// "1.005 s"
inline std::string instant_text(std::int64_t time_ns) {
  return report::to_ascii(report::instant(time_ns));
}
/// "20 ms"
inline std::string duration_text(std::int64_t time_ns) {
  return report::to_ascii(report::chosen_time(time_ns));
}
/// "1 tick", "12000 ticks"
inline std::string counted(std::uint64_t count, const char* one, const char* many) {
  return report::to_ascii(report::counted(count, one, many));
}

}  // namespace hil::expectations
