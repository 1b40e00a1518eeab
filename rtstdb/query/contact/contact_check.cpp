#include "rtstdb/query/contact/contact_check.hpp"

#include <algorithm>
#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"

namespace rtstdb::query {
namespace {

/// A capacity or limit outside its range.
Error out_of_range(const ContactQueryOptions& options, const char* what, std::uint32_t value,
                   std::uint32_t limit) {
  return {ErrorCode::capacity, "contact query '" + options.name + "' asks for " + std::to_string(value) +
                                   " " + what + "; 1 to " + std::to_string(limit) + " are possible"};
}

}  // namespace

std::optional<BadInput> check_body(EntityId entity, std::uint32_t element, const RowSource& rows) noexcept {
  const EntityState* state = rows.find(entity);
  if (state != nullptr && state->row.geometry.valid()) return std::nullopt;
  return BadInput{.reason = state == nullptr ? BadInputReason::unknown_entity : BadInputReason::no_geometry,
                  .element = element,
                  .entity = entity};
}

Result<void> check_contact_options(const ContactQueryOptions& options) {
  const auto is_outside = [](std::uint32_t value, std::uint32_t limit) {
    return value == 0 || value > limit;
  };
  if (is_outside(options.capacity, max_contact_searches))
    return out_of_range(options, "searches", options.capacity, max_contact_searches);
  if (is_outside(options.pairs_per_search, max_contact_pairs))
    return out_of_range(options, "pairs per search", options.pairs_per_search, max_contact_pairs);
  if (options.max_candidates > max_contact_candidates)
    return out_of_range(options, "candidates", options.max_candidates, max_contact_candidates);
  if (is_outside(options.max_bodies, max_entities))
    return out_of_range(options, "bodies", options.max_bodies, max_entities);
  if (options.max_surface_pairs > candidates_of(options))
    return out_of_range(options, "pairs of surfaces", options.max_surface_pairs, candidates_of(options));
  if (is_outside(options.max_surface_triangles, max_contact_surface_triangles))
    return out_of_range(options, "near triangles", options.max_surface_triangles,
                        max_contact_surface_triangles);
  return {};
}

std::uint32_t candidates_of(const ContactQueryOptions& options) noexcept {
  if (options.max_candidates > 0) return options.max_candidates;
  const std::uint64_t all = std::uint64_t{options.capacity} * options.pairs_per_search;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(all, max_contact_candidates));
}

std::uint32_t surface_pairs_of(const ContactQueryOptions& options) noexcept {
  return options.max_surface_pairs > 0 ? options.max_surface_pairs
                                       : std::min(candidates_of(options), default_contact_surface_pairs);
}

std::optional<BadInput> check_contact_search(const ContactSearch& search, std::uint32_t element,
                                             const RowSource& rows, TimeSpan& times) noexcept {
  // A NaN fails both conditions.
  const auto margin_m = static_cast<double>(search.margin_m);
  if (!(margin_m >= 0.0 && margin_m <= max_contact_margin_m)) {
    return with_field(refused(BadInputReason::bad_contact, element, {search.margin_m, 0.0f, 0.0f, 0.0f}),
                      "margin_m", margin_m, {.lowest = 0.0, .highest = max_contact_margin_m});
  }
  if (search.second.valid() && (!search.first.valid() || search.first == search.second)) {
    return BadInput{.reason = BadInputReason::bad_contact, .element = element, .entity = search.second};
  }
  if (search.first.valid()) {
    if (const auto bad = check_body(search.first, element, rows)) return bad;
  }
  if (search.second.valid()) {
    if (const auto bad = check_body(search.second, element, rows)) return bad;
  }
  return check_time(search.t, element, rows, times);
}

}  // namespace rtstdb::query
