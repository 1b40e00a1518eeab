#include "rtstdb/standing/membership_predictor.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <rtstdb/limits.hpp>

#include "rtstdb/standing/crossing.hpp"
#include "rtstdb/standing/distance.hpp"

namespace rtstdb::standing {
namespace {

constexpr std::int64_t never_ns = -1;

}  // namespace

ReachInterval reach_interval(const glm::dvec3& apart_m, const glm::dvec3& velocity_mps, double reach_m,
                             std::int64_t from_ns) noexcept {
  // Slightly enlarged, since the result only limits the search.
  const double reach = reach_m * (1.0 + 1e-9) + 1e-6;
  const double c = glm::dot(apart_m, apart_m) - reach * reach;
  const double b = glm::dot(apart_m, velocity_mps);
  const double a = glm::dot(velocity_mps, velocity_mps);
  constexpr double max_s = 4e9;  // just below max_world_time_ns, so that no sum overflows
  const auto at = [&](double s) {
    return s >= max_s ? max_world_time_ns
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

MembershipPredictor::MembershipPredictor(const QuerySpec& spec, const Motion& carrier, const Motion& entity,
                                         const EntityBox& box) noexcept
    : spec_(spec),
      box_(box),
      place_m_(point_on_body(carrier, spec.place_m).offset_m),
      motion_(point_on_body(entity, box.center_m).motion, point_on_body(carrier, spec.place_m).motion) {
  box_.center_m = point_on_body(entity, box.center_m).offset_m;
}

ConvexBody MembershipPredictor::body(std::int64_t from_ns, std::int64_t to_ns) const {
  if (spec_.kind == QuerySpec::Kind::box) return box_body(place_m_, spec_.q, spec_.half_extent_m);
  if (spec_.kind == QuerySpec::Kind::frustum)
    return frustum_body(place_m_, spec_.q, spec_.near_m, spec_.half_extent_m);
  // The ray is cut beyond the reach of the entity. The distance of the origins is largest at an end of the
  // interval, since their relative path is straight.
  const double far_m =
      std::max(glm::length(motion_.at(from_ns).apart_m), glm::length(motion_.at(to_ns).apart_m)) +
      box_.reach_m() + glm::length(place_m_) + 1.0;
  const double last_m = std::max(spec_.first_m, std::min(spec_.last_m, far_m));
  return segment_body(place_m_ + spec_.first_m * spec_.direction, place_m_ + last_m * spec_.direction,
                      spec_.direction);
}

double MembershipPredictor::reach_m() const noexcept {
  switch (spec_.kind) {
    case QuerySpec::Kind::box:
    case QuerySpec::Kind::frustum:
      return glm::length(place_m_) + glm::length(spec_.half_extent_m) + box_.reach_m();
    case QuerySpec::Kind::sphere:
    case QuerySpec::Kind::nearest:
      return glm::length(place_m_) + spec_.radius_m + box_.reach_m();
    case QuerySpec::Kind::ray:
      break;
  }
  return std::numeric_limits<double>::infinity();
}

template <class Use>
auto MembershipPredictor::with_border_function(std::int64_t from_ns, std::int64_t to_ns, Use use) const {
  if (spec_.kind == QuerySpec::Kind::sphere || spec_.kind == QuerySpec::Kind::nearest) {
    const bool farthest = spec_.test == RegionTest::inside && !box_.is_point;
    const SquaredDistance distance(motion_, place_m_, box_, farthest ? Measure::farthest : Measure::nearest);
    return use(WithinRadius(distance, spec_.radius_m, distance.noise_m(from_ns, to_ns)));
  }
  const ConvexBody shape = body(from_ns, to_ns);
  const double noise_m = motion_.noise_m(from_ns, to_ns, box_.reach_m() + shape.reach_m);
  return use(Separation(motion_, shape, box_, spec_.test, noise_m));
}

MembershipPredictor::Membership MembershipPredictor::membership_at(std::int64_t ns) const {
  return with_border_function(ns, ns, [&](const auto& function) {
    const auto sample = function.at(ns);
    return Membership{function.inside(sample),
                      function.has_crossed(sample, true) || function.has_crossed(sample, false)};
  });
}

MembershipPredictor::Next MembershipPredictor::next(std::int64_t from_ns, std::int64_t look_ahead_ns,
                                                    bool member) const {
  if (from_ns >= max_world_time_ns) return {Next::What::never, 0};
  std::int64_t begin_ns = from_ns;
  std::int64_t end_ns = std::min(max_world_time_ns - look_ahead_ns, from_ns) + look_ahead_ns;
  const double reach = reach_m();
  if (!member && std::isfinite(reach)) {
    const ReachInterval within_reach =
        reach_interval(motion_.at(from_ns).apart_m, motion_.velocity_mps(), reach, from_ns);
    if (within_reach.first_ns == never_ns) return {Next::What::never, 0};
    if (within_reach.first_ns > end_ns) return {Next::What::search_again, within_reach.first_ns};
    begin_ns = std::max(from_ns, within_reach.first_ns);
    const bool passes = within_reach.last_ns < end_ns;
    end_ns = std::max(begin_ns, std::min(end_ns, within_reach.last_ns));
    const Crossing found = with_border_function(begin_ns, end_ns, [&](const auto& function) {
      return first_crossing(function, begin_ns, end_ns, member);
    });
    if (found.what == Crossing::What::none && passes) return {Next::What::never, 0};
    return {found.what == Crossing::What::crossing ? Next::What::crossing : Next::What::search_again,
            found.ns};
  }
  const Crossing found = with_border_function(begin_ns, end_ns, [&](const auto& function) {
    return first_crossing(function, begin_ns, end_ns, member);
  });
  return {found.what == Crossing::What::crossing ? Next::What::crossing : Next::What::search_again, found.ns};
}

}  // namespace rtstdb::standing
