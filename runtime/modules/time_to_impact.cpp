#include "runtime/modules/time_to_impact.hpp"

#include <cstddef>
#include <limits>
#include <utility>

namespace hil::modules {

TimeToImpact::TimeToImpact(EventLog& events, const std::string& subject) {
  const auto add = [&](Unknown reason, const std::string& text) {
    kinds_[static_cast<std::size_t>(reason)] =
        events.add_kind("the time to impact of " + subject + " is not known: " + text);
  };
  add(Unknown::steps, "the bodies stay near one another for too many steps of the search");
  add(Unknown::distance, "the distance of two bodies is not known well enough");
  add(Unknown::capacity, "more bodies, or pairs of their parts, are near the path than are searched");
  add(Unknown::incomplete, "the search reached the device's limits");
}

double TimeToImpact::take(WorldStep& context, const rtstdb::ImpactAnswer& answer,
                          rtstdb::Nanoseconds window) noexcept {
  const Unknown reason = unknown_by(answer);
  const bool is_new = reason != std::exchange(last_, reason);
  if (reason != Unknown::none) {
    if (is_new) context.events->note(kinds_[static_cast<std::size_t>(reason)], context.time_ns);
    return std::numeric_limits<double>::quiet_NaN();
  }
  const rtstdb::Nanoseconds until = answer.status == rtstdb::ImpactStatus::impact ? answer.after : window;
  return static_cast<double>(until.count()) * 1e-9;
}

TimeToImpact::Unknown TimeToImpact::unknown_by(const rtstdb::ImpactAnswer& answer) noexcept {
  if (answer.incomplete) return Unknown::incomplete;
  if (answer.overflow) return Unknown::capacity;
  switch (answer.reason) {
    case rtstdb::UndecidedReason::none:
      return Unknown::none;
    case rtstdb::UndecidedReason::steps:
      return Unknown::steps;
    case rtstdb::UndecidedReason::distance:
      return Unknown::distance;
    case rtstdb::UndecidedReason::capacity:
      return Unknown::capacity;
  }
  return Unknown::none;
}

}  // namespace hil::modules
