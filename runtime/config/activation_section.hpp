#pragma once
// When a stimulus or a fault of a scenario is active.
//
// Threads: immutable once loaded.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/expression.hpp"

namespace hil::config {

struct Scenario;

/// When something is active. It begins once without `at`, `when` and `while`: at 0.
struct ActivationSection {
  std::optional<std::int64_t> at_ns;       ///< run time of its begin
  std::optional<std::int64_t> every_ns;    ///< with at_ns: from one begin to the next
  std::optional<Expression> when;          ///< begins where it becomes true
  std::optional<Expression> active_while;  ///< active where it is true
  std::optional<std::int64_t> for_ns;
  std::optional<Expression> until;
  std::uint64_t times = 1;   ///< that it begins, at most
  double probability = 1.0;  ///< of each begin

  /// The tick in which it begins at the earliest; ticks have this period, or are not known (0).
  std::int64_t earliest_begin_ns(std::int64_t period_ns) const noexcept {
    const std::int64_t at = at_ns.value_or(0);
    return period_ns > 0 ? (at + period_ns - 1) / period_ns * period_ns : at;
  }
};

/// Adds the keys of an activation to those of an entry.
void add_activation_fields(std::vector<Field>& fields);
/// False with mistakes.
bool read_activation(const Value& section, ActivationSection& activation, const Scenario& scenario,
                     Diagnostics& diagnostics);

/// A mistake where the duration is shorter than the base period: one tick would pass through any number of
/// them.
void need_a_tick(const Value& duration, const std::string& field, std::int64_t period_ns,
                 Diagnostics& diagnostics);

}  // namespace hil::config
