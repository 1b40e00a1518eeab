#include "runtime/config/run_end.hpp"

#include <hil/quantity.hpp>

namespace hil::config {

std::string reason_without_tick(std::int64_t time_ns, std::int64_t period_ns, std::int64_t duration_ns,
                                std::string_view last_tick) {
  constexpr const char* remedy = "; give an earlier time or a longer duration";
  if (duration_ns <= 0) return {};
  if (time_ns >= duration_ns)
    return " is not before the end of the run, which takes " + format_duration(duration_ns) + remedy;
  if (period_ns <= 0) return {};
  const std::int64_t last_tick_ns = (duration_ns - 1) / period_ns * period_ns;
  if (time_ns <= last_tick_ns) return {};
  return " is after " + std::string(last_tick) + " " + format_duration(last_tick_ns) + remedy;
}

}  // namespace hil::config
