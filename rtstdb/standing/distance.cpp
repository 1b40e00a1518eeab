#include "rtstdb/standing/distance.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

namespace rtstdb::standing {
namespace {

double seconds(std::int64_t from_ns, std::int64_t to_ns) noexcept {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

}  // namespace

SquaredDistance::SquaredDistance(const RelativeMotion& motion, const glm::dvec3& point_m,
                                 const EntityBox& entity, Measure measure) noexcept
    : motion_(motion),
      point_m_(point_m),
      entity_(entity),
      measure_(measure),
      entity_reach_m_(entity.is_point ? glm::length(entity.center_m) : entity.reach_m()),
      point_reach_m_(glm::length(point_m)) {}

SquaredDistance::Sample SquaredDistance::at(std::int64_t ns) const noexcept {
  Sample sample;
  sample.ns = ns;
  sample.view = motion_.at(ns);
  const glm::dvec3 from_origin_m =
      (point_m_ - sample.view.offset_m) * sample.view.rotation;  // by the transpose
  sample.from_center_m = from_origin_m - entity_.center_m;
  const glm::dvec3 along_m = glm::abs(sample.from_center_m);
  const glm::dvec3 away_m = measure_ == Measure::farthest
                                ? along_m + entity_.half_extent_m
                                : glm::max(along_m - entity_.half_extent_m, glm::dvec3(0.0));
  sample.value_m2 = glm::dot(away_m, away_m);
  return sample;
}

double SquaredDistance::value_of_same_corner_m2(const Sample& sample,
                                                const Sample& chosen_at) const noexcept {
  glm::dvec3 away_m = sample.from_center_m;
  for (int i = 0; i < 3; ++i)
    away_m[i] += chosen_at.from_center_m[i] >= 0.0 ? entity_.half_extent_m[i] : -entity_.half_extent_m[i];
  return glm::dot(away_m, away_m);
}

SquaredDistance::ChordDeviation SquaredDistance::chord_deviation(const Sample& a,
                                                                 const Sample& b) const noexcept {
  // d^2'' = 2 |d'|^2 + 2 d . d''. A centre is taken in the frame of the point; a box in its own frame, in
  // which it is at rest.
  const RelativeMotion::Bounds moves = entity_.is_point
                                           ? motion_.target_bounds(a.view, b.view, entity_reach_m_)
                                           : motion_.observer_bounds(a.view, b.view, point_reach_m_);
  const double farthest_m = std::sqrt(std::max(glm::dot(a.view.apart_m, a.view.apart_m),
                                               glm::dot(b.view.apart_m, b.view.apart_m))) +
                            entity_reach_m_ + point_reach_m_;
  const double near_m = std::sqrt(std::min(a.value_m2, b.value_m2)) + moves.speed_mps * seconds(a.ns, b.ns);
  const double curvature = 2.0 * std::min(farthest_m, near_m) * moves.acceleration_mps2;
  return {curvature + 2.0 * moves.speed_mps * moves.speed_mps, curvature};
}

double SquaredDistance::noise_m(std::int64_t first_ns, std::int64_t last_ns) const noexcept {
  return motion_.noise_m(first_ns, last_ns, entity_reach_m_ + point_reach_m_);
}

bool WithinRadius::certainly_stays(const Sample& a, const Sample& b, bool member) const noexcept {
  const SquaredDistance::ChordDeviation chord_deviation = distance_.chord_deviation(a, b);
  const double h_s = seconds(a.ns, b.ns);
  const double factor = h_s * h_s / 8.0;
  if (member) return std::max(a.value_m2, b.value_m2) + chord_deviation.above * factor <= out_m2_;
  double min_m2 = std::min(a.value_m2, b.value_m2);
  if (distance_.measure() == Measure::farthest) {
    min_m2 = std::max(std::min(a.value_m2, distance_.value_of_same_corner_m2(b, a)),
                      std::min(b.value_m2, distance_.value_of_same_corner_m2(a, b)));
  }
  return min_m2 - chord_deviation.below * factor >= in_m2_;
}

Nearer::Sample Nearer::at(std::int64_t ns) const noexcept {
  Sample sample;
  sample.ns = ns;
  sample.challenger = challenger_.at(ns);
  sample.holder = holder_.at(ns);
  sample.value_m2 = sample.challenger.value_m2 - sample.holder.value_m2 - bias_m2_;
  // The noise of the squared distances that corresponds to noise_m.
  sample.noise_m2 =
      1e-18 + noise_m_ * (std::sqrt(sample.challenger.value_m2) + std::sqrt(sample.holder.value_m2));
  return sample;
}

bool Nearer::certainly_stays(const Sample& a, const Sample& b, bool member) const noexcept {
  const SquaredDistance::ChordDeviation challenger = challenger_.chord_deviation(a.challenger, b.challenger);
  const SquaredDistance::ChordDeviation holder = holder_.chord_deviation(a.holder, b.holder);
  const double h_s = seconds(a.ns, b.ns);
  const double factor = h_s * h_s / 8.0;
  const double noise_m2 = std::min(a.noise_m2, b.noise_m2);
  if (member)
    return std::max(a.value_m2, b.value_m2) + (challenger.above + holder.below) * factor <= noise_m2;
  return std::min(a.value_m2, b.value_m2) - (challenger.below + holder.above) * factor >= -noise_m2;
}

}  // namespace rtstdb::standing
