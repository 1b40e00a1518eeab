#include "rtstdb/query/impact/impact_check.hpp"

#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/contact/contact_check.hpp"
#include "rtstdb/query/element_check.hpp"

namespace rtstdb::query {

Result<void> check_impact_options(const ImpactQueryOptions& options) {
  const std::uint64_t candidates = std::uint64_t{options.capacity} * options.candidates_per_search;
  if (options.capacity == 0 || options.capacity > max_contact_searches ||
      options.candidates_per_search == 0 || candidates > max_contact_candidates) {
    return Error{ErrorCode::capacity,
                 "impact query '" + options.name + "' asks for " + std::to_string(options.capacity) +
                     " searches of " + std::to_string(options.candidates_per_search) + " candidates; 1 to " +
                     std::to_string(max_contact_searches) + " searches of at least 1, and " +
                     std::to_string(max_contact_candidates) + " candidates in all, are possible"};
  }
  return {};
}

std::optional<BadInput> check_impact_search(const ImpactSearch& search, std::uint32_t element,
                                            const RowSource& rows, TimeSpan& times) noexcept {
  constexpr Nanoseconds longest(max_impact_window_ns);
  if (search.window < Nanoseconds(0) || search.window > longest) {
    return with_duration(BadInput{.reason = BadInputReason::bad_impact, .element = element, .entity = {}},
                         "window", search.window, Nanoseconds(0), longest);
  }
  // In single precision, so that the limits themselves are allowed. A NaN fails both conditions.
  constexpr auto lowest_m = static_cast<float>(min_impact_tolerance_m);
  constexpr auto highest_m = static_cast<float>(max_contact_margin_m);
  if (!(search.tolerance_m >= lowest_m && search.tolerance_m <= highest_m)) {
    return with_field(BadInput{.reason = BadInputReason::bad_impact, .element = element, .entity = {}},
                      "tolerance_m", static_cast<double>(search.tolerance_m),
                      {.lowest = min_impact_tolerance_m, .highest = max_contact_margin_m});
  }
  if (const auto bad = check_body(search.first, element, rows)) return bad;
  if (search.first == search.second)
    return BadInput{.reason = BadInputReason::bad_impact, .element = element, .entity = search.second};
  if (search.second.valid()) {
    if (const auto bad = check_body(search.second, element, rows)) return bad;
  }
  return check_time(search.t, element, rows, times);
}

}  // namespace rtstdb::query
