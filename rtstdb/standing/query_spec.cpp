#include "rtstdb/standing/query_spec.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <sstream>
#include <string_view>

#include <rtstdb/limits.hpp>

namespace rtstdb::standing {
namespace {

Error refusal(const std::string& name, std::string_view what, std::initializer_list<double> values) {
  std::ostringstream text;
  text.precision(9);
  text << "standing query '" << name << "': " << what << " (";
  const char* separator = "";
  for (const double value : values) {
    text << separator << value;
    separator = ", ";
  }
  text << ")";
  return {ErrorCode::bad_input, text.str()};
}

bool is_valid_point(const glm::vec3& point_m) {
  const auto valid = [](float x) {
    return std::isfinite(x) && std::abs(x) <= static_cast<float>(max_coordinate_m);
  };
  return valid(point_m.x) && valid(point_m.y) && valid(point_m.z);
}

Error bad_point(const std::string& name, std::string_view what, const glm::vec3& p) {
  return refusal(name, std::string(what) + " must be finite and within max_coordinate_m", {p.x, p.y, p.z});
}

bool is_known(StandingTarget target) {
  return target == StandingTarget::bounds || target == StandingTarget::center;
}

Error unknown_target(const std::string& name, StandingTarget target) {
  return refusal(name, "its target is not a StandingTarget", {static_cast<double>(target)});
}

/// Whether the region has no volume.
bool is_flat(const Region& region) {
  const glm::vec3& half = region.half_extent_m;
  if (region.shape == RegionShape::sphere) return half.x == 0.0f;
  if (region.shape == RegionShape::frustum && region.near_m == half.x) return true;
  return half.x == 0.0f || half.y == 0.0f || half.z == 0.0f;
}

Result<void> check(const StandingRegion& query, const std::string& name) {
  const Region& region = query.region;
  const glm::vec3& half = region.half_extent_m;
  if (region.shape > RegionShape::frustum || region.test > RegionTest::inside)
    return refusal(name, "its shape or test is not a RegionShape or RegionTest",
                   {static_cast<double>(region.shape), static_cast<double>(region.test)});
  if (!is_known(query.target)) return unknown_target(name, query.target);
  if (!is_valid_point(region.center_m)) return bad_point(name, "the region's centre", region.center_m);
  if (!is_valid_point(half)) return bad_point(name, "the region's half extent", half);
  if (!(half.x >= 0.0f && half.y >= 0.0f && half.z >= 0.0f))
    return refusal(name, "the region's half extent must not be negative", {half.x, half.y, half.z});
  if (region.shape == RegionShape::frustum &&
      !(half.x > 0.0f && region.near_m >= 0.0f && region.near_m <= half.x))
    return refusal(name, "a frustum needs 0 <= near_m <= half_extent_m.x and half_extent_m.x > 0",
                   {region.near_m, half.x});
  const float length = glm::length(region.q);
  if (!(length > 1e-6f && length < 1e6f))
    return refusal(name, "the length of the region's orientation must be between 1e-6 and 1e6",
                   {region.q.w, region.q.x, region.q.y, region.q.z});
  const bool needs_volume = query.target == StandingTarget::center || region.test == RegionTest::inside;
  if (needs_volume && is_flat(region))
    return refusal(name, "the region is empty: no entity can be inside for any length of time",
                   {half.x, half.y, half.z, region.near_m});
  return {};
}

}  // namespace

Result<QuerySpec> make_query_spec(const StandingRegion& query, const std::string& name) {
  if (auto checked = check(query, name); !checked) return checked.error();
  const Region& region = query.region;
  QuerySpec spec;
  spec.kind = region.shape == RegionShape::box      ? QuerySpec::Kind::box
              : region.shape == RegionShape::sphere ? QuerySpec::Kind::sphere
                                                    : QuerySpec::Kind::frustum;
  spec.test = region.test;
  spec.target = query.target;
  spec.place_m = glm::dvec3(region.center_m);
  spec.q = glm::normalize(glm::dquat(region.q));
  spec.half_extent_m = glm::dvec3(region.half_extent_m);
  spec.near_m = static_cast<double>(region.near_m);
  spec.radius_m = spec.half_extent_m.x;
  spec.mask = region.mask;
  spec.carrier = region.carrier;
  spec.excluded = query.excluded;
  return spec;
}

Result<QuerySpec> make_query_spec(const StandingRay& query, const std::string& name) {
  const Ray& ray = query.ray;
  if (!is_valid_point(ray.origin_m)) return bad_point(name, "the ray's origin", ray.origin_m);
  const glm::dvec3 direction(ray.direction);
  const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  if (!std::isfinite(direction.x + direction.y + direction.z) || !(largest >= 1e-15 && largest <= 1e15))
    return refusal(name, "the largest component of the ray's direction must be between 1e-15 and 1e15",
                   {ray.direction.x, ray.direction.y, ray.direction.z});
  if (!(ray.lambda_min >= 0.0f && ray.lambda_max >= ray.lambda_min && std::isfinite(ray.lambda_min)))
    return refusal(name, "the ray's range needs 0 <= lambda_min <= lambda_max",
                   {ray.lambda_min, ray.lambda_max});
  const double length = glm::length(direction);
  QuerySpec spec;
  spec.kind = QuerySpec::Kind::ray;
  spec.place_m = glm::dvec3(ray.origin_m);
  spec.direction = direction / length;
  spec.first_m = static_cast<double>(ray.lambda_min) * length;
  spec.last_m = static_cast<double>(ray.lambda_max) * length;
  spec.mask = ray.mask;
  spec.carrier = ray.carrier;
  spec.excluded = query.excluded;
  return spec;
}

Result<QuerySpec> make_query_spec(const StandingNearest& query, const std::string& name) {
  const Nearest& point = query.point;
  if (!is_known(query.target)) return unknown_target(name, query.target);
  if (!is_valid_point(point.point_m)) return bad_point(name, "the point", point.point_m);
  if (!(point.radius_m >= 0.0f)) return refusal(name, "the radius must not be negative", {point.radius_m});
  if (query.target == StandingTarget::center && point.radius_m == 0.0f)
    return refusal(name, "the radius is zero: no centre can be within it for any length of time",
                   {point.radius_m});
  if (query.k == 0 || query.k > max_neighbors)
    return refusal(name, "k must be 1 to max_neighbors",
                   {static_cast<double>(query.k), static_cast<double>(max_neighbors)});
  QuerySpec spec;
  spec.kind = QuerySpec::Kind::nearest;
  spec.target = query.target;
  spec.place_m = glm::dvec3(point.point_m);
  spec.radius_m = static_cast<double>(point.radius_m);
  spec.k = query.k;
  spec.mask = point.mask;
  spec.carrier = point.carrier;
  spec.excluded = point.excluded;
  return spec;
}

}  // namespace rtstdb::standing
