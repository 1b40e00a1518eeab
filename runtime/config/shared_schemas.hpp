#pragma once
// Schemas that several sections of a scenario share.

#include <limits>
#include <string>

#include <hil/numbers.hpp>
#include <hil/schema.hpp>

namespace hil::config {

inline constexpr double any_low = -std::numeric_limits<double>::infinity();
inline constexpr double any_high = std::numeric_limits<double>::infinity();
inline constexpr double max_duration_s = 7.0 * 24.0 * 3600.0;
inline constexpr double min_duration_s = 1e-9;
/// 99 is for threads of the kernel, which everything waits for.
inline constexpr int highest_priority = 98;

inline Schema duration_schema(double minimum_s, double maximum_s = max_duration_s) {
  return Schema::quantity(Quantity::duration_s, minimum_s, maximum_s);
}

inline Schema rate_schema() {
  return Schema::quantity(Quantity::frequency_hz, 1e-4, 1e5);
}

inline Schema thread_priority_schema() {
  return Schema::integer(1, highest_priority);
}

/// `subject`: a sentence that says what is lost, and when.
inline Field may_be_lost_field(const std::string& subject) {
  return Field::with_default(
      "may_be_lost", Schema::boolean(), "false",
      "Whether the run may pass although it is lost (otherwise exit code 4). " + subject);
}

/// Share of the ticks after its first arrival on which an input may be not fresh in a run that passes.
inline constexpr double max_missing_share = 0.05;

/// `subject`: what need not come.
inline Field optional_field(const std::string& subject) {
  return Field::with_default("optional", Schema::boolean(), "false",
                             "Whether the run may pass although " + subject +
                                 " never comes or is not fresh on more than " +
                                 format_number(100.0 * max_missing_share) +
                                 " % of the ticks after its first arrival (otherwise exit code 1).");
}

}  // namespace hil::config
