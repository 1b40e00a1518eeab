#include "rtstdb/standing/question.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <string_view>

#include <rtstdb/limits.hpp>

#include "rtstdb/standing/crossing.hpp"
#include "rtstdb/standing/distance.hpp"

namespace rtstdb::standing {
namespace {

Error refusal(const std::string& name, std::string_view what, std::initializer_list<double> values) {
  std::ostringstream words;
  words.precision(9);
  words << "standing query '" << name << "': " << what << " (";
  const char* between = "";
  for (const double value : values) {
    words << between << value;
    between = ", ";
  }
  words << ")";
  return {ErrorCode::bad_input, words.str()};
}

bool good_point(const glm::vec3& point_m) {
  const auto good = [](float x) {
    return std::isfinite(x) && std::abs(x) <= static_cast<float>(max_coordinate_m);
  };
  return good(point_m.x) && good(point_m.y) && good(point_m.z);
}

Error bad_point(const std::string& name, std::string_view what, const glm::vec3& p) {
  return refusal(name, std::string(what) + " is not finite or beyond max_coordinate_m", {p.x, p.y, p.z});
}

bool known(StandingTarget target) {
  return target == StandingTarget::bounds || target == StandingTarget::center;
}

Error unknown_target(const std::string& name, StandingTarget target) {
  return refusal(name, "its target is none of the enumerators", {static_cast<double>(target)});
}

/// Whether the region has no volume.
bool is_flat(const Region& region) {
  const glm::vec3& half = region.half_extent_m;
  if (region.shape == RegionShape::sphere) return half.x == 0.0f;
  if (region.shape == RegionShape::frustum && region.near_m == half.x) return true;
  return half.x == 0.0f || half.y == 0.0f || half.z == 0.0f;
}

Result<void> check(const StandingRegion& asked, const std::string& name) {
  const Region& region = asked.region;
  const glm::vec3& half = region.half_extent_m;
  if (region.shape > RegionShape::frustum || region.test > RegionTest::inside)
    return refusal(name, "its shape or test is none of the enumerators",
                   {static_cast<double>(region.shape), static_cast<double>(region.test)});
  if (!known(asked.target)) return unknown_target(name, asked.target);
  if (!good_point(region.center_m)) return bad_point(name, "the region's centre", region.center_m);
  if (!good_point(half)) return bad_point(name, "the region's half extent", half);
  if (!(half.x >= 0.0f && half.y >= 0.0f && half.z >= 0.0f))
    return refusal(name, "the region's half extent is negative", {half.x, half.y, half.z});
  if (region.shape == RegionShape::frustum &&
      !(half.x > 0.0f && region.near_m >= 0.0f && region.near_m <= half.x))
    return refusal(name, "a frustum needs 0 <= near_m <= half_extent_m.x, which is above zero",
                   {region.near_m, half.x});
  const float length = glm::length(region.q);
  if (!(length > 1e-6f && length < 1e6f))
    return refusal(name, "the region's orientation has no length",
                   {region.q.w, region.q.x, region.q.y, region.q.z});
  const bool takes_room = asked.target == StandingTarget::center || region.test == RegionTest::inside;
  if (takes_room && is_flat(region))
    return refusal(name, "the region is empty: nobody can be in it for any time",
                   {half.x, half.y, half.z, region.near_m});
  return {};
}

constexpr std::int64_t never_ns = -1;

}  // namespace

Result<Question> question_of(const StandingRegion& asked, const std::string& name) {
  if (auto checked = check(asked, name); !checked) return checked.error();
  const Region& region = asked.region;
  Question question;
  question.kind = region.shape == RegionShape::box      ? Question::Kind::box
                  : region.shape == RegionShape::sphere ? Question::Kind::sphere
                                                        : Question::Kind::frustum;
  question.test = region.test;
  question.target = asked.target;
  question.place_m = glm::dvec3(region.center_m);
  question.q = glm::normalize(glm::dquat(region.q));
  question.half_extent_m = glm::dvec3(region.half_extent_m);
  question.near_m = static_cast<double>(region.near_m);
  question.radius_m = question.half_extent_m.x;
  question.mask = region.mask;
  question.carrier = region.carrier;
  question.excluded = asked.excluded;
  return question;
}

Result<Question> question_of(const StandingRay& asked, const std::string& name) {
  const Ray& ray = asked.ray;
  if (!good_point(ray.origin_m)) return bad_point(name, "the ray's origin", ray.origin_m);
  const glm::dvec3 direction(ray.direction);
  const double largest = std::max({std::abs(direction.x), std::abs(direction.y), std::abs(direction.z)});
  if (!std::isfinite(direction.x + direction.y + direction.z) || !(largest >= 1e-15 && largest <= 1e15))
    return refusal(name, "the ray's direction has no length between 1e-15 and 1e15",
                   {ray.direction.x, ray.direction.y, ray.direction.z});
  if (!(ray.lambda_min >= 0.0f && ray.lambda_max >= ray.lambda_min && std::isfinite(ray.lambda_min)))
    return refusal(name, "the ray's range needs 0 <= lambda_min <= lambda_max",
                   {ray.lambda_min, ray.lambda_max});
  const double length = glm::length(direction);
  Question question;
  question.kind = Question::Kind::ray;
  question.place_m = glm::dvec3(ray.origin_m);
  question.direction = direction / length;
  question.first_m = static_cast<double>(ray.lambda_min) * length;
  question.last_m = static_cast<double>(ray.lambda_max) * length;
  question.mask = ray.mask;
  question.carrier = ray.carrier;
  question.excluded = asked.excluded;
  return question;
}

Result<Question> question_of(const StandingNearest& asked, const std::string& name) {
  const Nearest& point = asked.point;
  if (!known(asked.target)) return unknown_target(name, asked.target);
  if (!good_point(point.point_m)) return bad_point(name, "the point", point.point_m);
  if (!(point.radius_m >= 0.0f))
    return refusal(name, "the radius is negative or no number", {point.radius_m});
  if (asked.target == StandingTarget::center && point.radius_m == 0.0f)
    return refusal(name, "the radius is zero: no centre can be within it for any time", {point.radius_m});
  if (asked.k == 0 || asked.k > max_neighbors)
    return refusal(name, "k is not within 1 and max_neighbors",
                   {static_cast<double>(asked.k), static_cast<double>(max_neighbors)});
  Question question;
  question.kind = Question::Kind::nearest;
  question.target = asked.target;
  question.place_m = glm::dvec3(point.point_m);
  question.radius_m = static_cast<double>(point.radius_m);
  question.k = asked.k;
  question.mask = point.mask;
  question.carrier = point.carrier;
  question.excluded = point.excluded;
  return question;
}

// ---- membership of one entity

Meeting meeting(const glm::dvec3& apart_m, const glm::dvec3& velocity_mps, double reach_m,
                std::int64_t from_ns) noexcept {
  // Slightly enlarged, since the result only limits the search.
  const double reach = reach_m * (1.0 + 1e-9) + 1e-6;
  const double c = glm::dot(apart_m, apart_m) - reach * reach;
  const double b = glm::dot(apart_m, velocity_mps);
  const double a = glm::dot(velocity_mps, velocity_mps);
  constexpr double most_s = 4e9;  // just below max_world_time_ns, so that no sum overflows
  const auto at = [&](double s) {
    return s >= most_s ? max_world_time_ns
                       : std::min(max_world_time_ns, from_ns + static_cast<std::int64_t>(s * 1e9));
  };
  const double root = b * b - a * c;
  if (c <= 0.0) {
    // Within reach now, up to the larger root.
    if (a == 0.0) return {from_ns, max_world_time_ns};
    return {from_ns, at((-b + std::sqrt(std::max(root, 0.0))) / a + 1e-6)};
  }
  if (b >= 0.0 || a == 0.0 || root < 0.0) return {never_ns, never_ns};
  const double first_s = c / (-b + std::sqrt(root));
  const double last_s = (-b + std::sqrt(root)) / a;
  // One part in 1e9 is larger than the rounding error of the roots.
  return {at(std::max(0.0, first_s * (1.0 - 1e-9) - 1e-6)), at(last_s * (1.0 + 1e-9) + 1e-6)};
}

MembershipPredictor::MembershipPredictor(const Question& question, const Motion& carrier,
                                         const Motion& entity, const EntityBox& box) noexcept
    : question_(question),
      box_(box),
      place_m_(carried(carrier, question.place_m).offset_m),
      motion_(carried(entity, box.center_m).motion, carried(carrier, question.place_m).motion) {
  box_.center_m = carried(entity, box.center_m).offset_m;
}

ConvexBody MembershipPredictor::body(std::int64_t from_ns, std::int64_t to_ns) const {
  if (question_.kind == Question::Kind::box) return box_body(place_m_, question_.q, question_.half_extent_m);
  if (question_.kind == Question::Kind::frustum)
    return frustum_body(place_m_, question_.q, question_.near_m, question_.half_extent_m);
  // The ray is cut beyond the reach of the entity. The distance of the origins is largest at an end of the
  // interval, since their relative path is straight.
  const double far_m =
      std::max(glm::length(motion_.at(from_ns).apart_m), glm::length(motion_.at(to_ns).apart_m)) +
      box_.reach_m() + glm::length(place_m_) + 1.0;
  const double last_m = std::max(question_.first_m, std::min(question_.last_m, far_m));
  return segment_body(place_m_ + question_.first_m * question_.direction,
                      place_m_ + last_m * question_.direction, question_.direction);
}

double MembershipPredictor::reach_m() const noexcept {
  switch (question_.kind) {
    case Question::Kind::box:
    case Question::Kind::frustum:
      return glm::length(place_m_) + glm::length(question_.half_extent_m) + box_.reach_m();
    case Question::Kind::sphere:
    case Question::Kind::nearest:
      return glm::length(place_m_) + question_.radius_m + box_.reach_m();
    case Question::Kind::ray:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

template <class Use>
auto MembershipPredictor::with_gap(std::int64_t from_ns, std::int64_t to_ns, Use use) const {
  if (question_.kind == Question::Kind::sphere || question_.kind == Question::Kind::nearest) {
    const bool farthest = question_.test == RegionTest::inside && !box_.is_point;
    const SquaredDistance distance(motion_, place_m_, box_, farthest ? Measure::farthest : Measure::nearest);
    return use(WithinRadius(distance, question_.radius_m, distance.noise_m(from_ns, to_ns)));
  }
  const ConvexBody shape = body(from_ns, to_ns);
  const double noise_m = motion_.noise_m(from_ns, to_ns, box_.reach_m() + shape.reach_m);
  return use(Separation(motion_, shape, box_, question_.test, noise_m));
}

MembershipPredictor::Place MembershipPredictor::place(std::int64_t ns) const {
  return with_gap(ns, ns, [&](const auto& gap) {
    const auto look = gap.at(ns);
    return Place{gap.inside(look), gap.beyond(look, true) || gap.beyond(look, false)};
  });
}

MembershipPredictor::Next MembershipPredictor::next(std::int64_t from_ns, std::int64_t look_ahead_ns,
                                                    bool member) const {
  if (from_ns >= max_world_time_ns) return {Next::What::never, 0};
  std::int64_t begin_ns = from_ns;
  std::int64_t end_ns = std::min(max_world_time_ns - look_ahead_ns, from_ns) + look_ahead_ns;
  const double reach = reach_m();
  if (!member && std::isfinite(reach)) {
    const Meeting near = meeting(motion_.at(from_ns).apart_m, motion_.velocity_mps(), reach, from_ns);
    if (near.first_ns == never_ns) return {Next::What::never, 0};
    if (near.first_ns > end_ns) return {Next::What::look_again, near.first_ns};
    begin_ns = std::max(from_ns, near.first_ns);
    const bool passes = near.last_ns < end_ns;
    end_ns = std::max(begin_ns, std::min(end_ns, near.last_ns));
    const Crossing found = with_gap(
        begin_ns, end_ns, [&](const auto& gap) { return first_flip(gap, begin_ns, end_ns, member); });
    if (found.what == Crossing::What::none && passes) return {Next::What::never, 0};
    return {found.what == Crossing::What::flip ? Next::What::flip : Next::What::look_again, found.ns};
  }
  const Crossing found =
      with_gap(begin_ns, end_ns, [&](const auto& gap) { return first_flip(gap, begin_ns, end_ns, member); });
  return {found.what == Crossing::What::flip ? Next::What::flip : Next::What::look_again, found.ns};
}

}  // namespace rtstdb::standing
