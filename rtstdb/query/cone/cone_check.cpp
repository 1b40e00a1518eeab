#include "rtstdb/query/cone/cone_check.hpp"

#include <numbers>
#include <string>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "rtstdb/query/enumerator.hpp"
#include "rtstdb/query/ray/ray_check.hpp"

namespace rtstdb::query {

static_assert(static_cast<double>(max_opening_angle_rad) < std::numbers::pi);

Result<void> check_cone_options(const ConeQueryOptions& options) {
  if (auto known = check_enumerator(options.name, "faces", options.faces, Faces::back); !known) return known;
  if (auto known = check_enumerator(options.name, "mode", options.mode, ConeMode::fast); !known) return known;
  if (options.capacity == 0 || options.capacity > max_cones_per_query || options.returns_per_cone == 0 ||
      options.returns_per_cone > max_returns_per_cone) {
    return Error{ErrorCode::capacity, "cone query '" + options.name + "' asks for " +
                                          std::to_string(options.returns_per_cone) + " returns of " +
                                          std::to_string(options.capacity) + " cones; 1 to " +
                                          std::to_string(max_returns_per_cone) + " returns of 1 to " +
                                          std::to_string(max_cones_per_query) + " cones are possible"};
  }
  return {};
}

std::optional<BadInput> check_cone(const Cone& cone, std::uint32_t element, const RowSource& rows,
                                   TimeSpan& times) noexcept {
  if (const auto bad = check_point(cone.origin_m, element, {"origin_m.x", "origin_m.y", "origin_m.z"}))
    return bad;
  if (const auto bad = check_direction(cone.direction, element)) return bad;
  // A NaN fails both conditions.
  if (!(cone.opening_angle_rad >= 0.0f && cone.opening_angle_rad <= max_opening_angle_rad)) {
    return with_field(refused(BadInputReason::bad_cone, element, {cone.opening_angle_rad, 0.0f, 0.0f, 0.0f}),
                      "opening_angle_rad", static_cast<double>(cone.opening_angle_rad),
                      {.lowest = 0.0, .highest = static_cast<double>(max_opening_angle_rad)});
  }
  if (!(cone.lambda_max >= 0.0f)) {
    return with_field(refused(BadInputReason::bad_cone, element, {cone.lambda_max, 0.0f, 0.0f, 0.0f}),
                      "lambda_max", static_cast<double>(cone.lambda_max), {.lowest = 0.0});
  }
  if (const auto bad = check_time(cone.t, element, rows, times)) return bad;
  return check_carrier(cone.carrier, element, rows);
}

}  // namespace rtstdb::query
