#include "rtstdb/standing/separation.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace rtstdb::standing {
namespace {

/// The product of nearly parallel edges is no usable axis; the normals of the faces cover its direction.
constexpr double min_sine = 1e-9;

double sign_of(int side) noexcept {
  return side == 0 ? 1.0 : -1.0;
}

}  // namespace

double EntityBox::reach_m() const noexcept {
  return glm::length(glm::abs(center_m) + half_extent_m);
}

Separation::Separation(const RelativeMotion& motion, const ConvexBody& body, const EntityBox& entity,
                       RegionTest test, double noise_m) noexcept
    : motion_(motion),
      body_(body),
      entity_(entity),
      touching_(test == RegionTest::touching && !entity.is_point),
      noise_m_(noise_m),
      entity_reach_m_(entity.reach_m()) {
  const std::size_t faces = touching_ ? body.normals.size() : body.faces.size();
  for (std::size_t i = 0; i < faces; ++i)
    axes_.add({Axis::Kind::body, static_cast<std::uint8_t>(i), 0});
  if (!touching_) return;
  for (std::uint8_t i = 0; i < 3; ++i)
    axes_.add({Axis::Kind::entity, i, 0});
  for (std::uint8_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < body.edges.size(); ++j)
      axes_.add({Axis::Kind::product, i, static_cast<std::uint8_t>(j)});
  }
}

glm::dvec3 Separation::direction(const Axis& axis, const RelativeMotion::View& view) const noexcept {
  switch (axis.kind) {
    case Axis::Kind::body:
      return touching_ ? body_.normals[axis.first] : body_.faces[axis.first].outward;
    case Axis::Kind::entity:
      return view.rotation[axis.first];
    case Axis::Kind::product:
      break;
  }
  return glm::cross(view.rotation[axis.first], body_.edges[axis.second]);
}

glm::dvec3 Separation::entity_corner_m(const RelativeMotion::View& view, std::uint8_t corner) const noexcept {
  glm::dvec3 local_m = entity_.center_m;
  for (int i = 0; i < 3; ++i)
    local_m[i] += (corner >> i & 1) != 0 ? entity_.half_extent_m[i] : -entity_.half_extent_m[i];
  return view.offset_m + view.rotation * local_m;
}

double Separation::gap_of(const Axis& axis, int side, const Sample::Corners& corners,
                          const RelativeMotion::View& view) const noexcept {
  const glm::dvec3 u = direction(axis, view);
  const glm::dvec3 entity_m = entity_corner_m(view, corners.entity);
  if (!touching_) return glm::dot(u, entity_m) - body_.faces[axis.first].offset_m;
  return sign_of(side) * glm::dot(u, entity_m - body_.corners_m[corners.body]);
}

Separation::Sample Separation::at(std::int64_t ns) const noexcept {
  Sample sample;
  sample.ns = ns;
  sample.view = motion_.at(ns);
  sample.worst_m = -std::numeric_limits<double>::infinity();
  const glm::dvec3 center_m = sample.view.offset_m + sample.view.rotation * entity_.center_m;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const Axis& axis = axes_[k];
    const glm::dvec3 u = direction(axis, sample.view);
    double extent_m = 0.0;
    std::uint8_t positive = 0;  // the corner of the entity that lies farthest along u
    for (int i = 0; i < 3; ++i) {
      const double along = glm::dot(u, sample.view.rotation[i]);
      extent_m += entity_.half_extent_m[i] * std::abs(along);
      if (along >= 0.0) positive = static_cast<std::uint8_t>(positive | 1u << i);
    }
    const double middle_m = glm::dot(u, center_m);
    auto& ends = sample.ends[k];
    sample.length[k] = axis.kind == Axis::Kind::product ? glm::length(u) : 1.0;
    if (!touching_) {
      ends[0] = {middle_m + extent_m - body_.faces[axis.first].offset_m, positive, 0};
      sample.worst_m = std::max(sample.worst_m, ends[0].gap);
      continue;
    }
    double low_m = std::numeric_limits<double>::infinity();
    double high_m = -low_m;
    std::size_t lowest = 0;
    std::size_t highest = 0;
    for (std::size_t corner = 0; corner < body_.corners_m.size(); ++corner) {
      const double along_m = glm::dot(u, body_.corners_m[corner]);
      if (along_m < low_m) lowest = corner;
      if (along_m > high_m) highest = corner;
      low_m = std::min(low_m, along_m);
      high_m = std::max(high_m, along_m);
    }
    const auto negative = static_cast<std::uint8_t>(~positive & 7u);
    ends[0] = {middle_m - extent_m - high_m, negative, static_cast<std::uint8_t>(highest)};
    ends[1] = {low_m - middle_m - extent_m, positive, static_cast<std::uint8_t>(lowest)};
    if (sample.length[k] > min_sine)
      sample.worst_m = std::max(sample.worst_m, std::max(ends[0].gap, ends[1].gap) / sample.length[k]);
  }
  return sample;
}

Separation::AxisBounds Separation::axis_bounds(std::size_t axis, const Sample& a,
                                               const Sample& b) const noexcept {
  const Axis& axis_kind = axes_[axis];
  if (axis_kind.kind == Axis::Kind::body)
    return {motion_.target_acceleration(a.view, b.view, direction(axis_kind, a.view), entity_reach_m_), 1.0,
            1.0};
  if (axis_kind.kind == Axis::Kind::entity) {
    glm::dvec3 axis_direction(0.0);
    axis_direction[axis_kind.first] = 1.0;
    return {motion_.observer_acceleration(a.view, b.view, axis_direction, body_.reach_m), 1.0, 1.0};
  }
  // The second derivative of (e x b) . (y - s) with constant b and s: its terms contain e'', e' and y''.
  glm::dvec3 edge(0.0);
  edge[axis_kind.first] = 1.0;
  const RelativeMotion::DirectionBounds edge_bounds = motion_.direction_bounds(edge);
  const RelativeMotion::Bounds corner = motion_.target_bounds(a.view, b.view, entity_reach_m_);
  const double h_s = static_cast<double>(b.ns - a.ns) * 1e-9;
  const double across_m = std::sqrt(std::max(glm::dot(a.view.apart_m, a.view.apart_m),
                                             glm::dot(b.view.apart_m, b.view.apart_m))) +
                          entity_reach_m_ + body_.reach_m;
  const double min_length = std::min(a.length[axis], b.length[axis]) - edge_bounds.rate * h_s;
  const double max_length = std::min(1.0, std::max(a.length[axis], b.length[axis]) + edge_bounds.rate * h_s);
  return {edge_bounds.second_derivative * across_m + 2.0 * edge_bounds.rate * corner.speed_mps +
              max_length * corner.acceleration_mps2,
          std::max(min_length, 0.0), max_length};
}

double Separation::min_gap_m(std::size_t axis, int side, const Sample& a, const Sample& b,
                             double deviation_m) const noexcept {
  const auto& end_a = a.ends[axis][static_cast<std::size_t>(side)];
  const auto& end_b = b.ends[axis][static_cast<std::size_t>(side)];
  // touching: each corner's gap is at least the smallest one at both ends. inside: the largest gap is at
  // least that of any one corner.
  if (touching_) return std::min(end_a.gap, end_b.gap) - deviation_m;
  const double same_as_a = std::min(end_a.gap, gap_of(axes_[axis], side, end_a, b.view));
  const double same_as_b = std::min(end_b.gap, gap_of(axes_[axis], side, end_b, a.view));
  return std::max(same_as_a, same_as_b) - deviation_m;
}

double Separation::max_gap_m(std::size_t axis, int side, const Sample& a, const Sample& b,
                             double deviation_m) const noexcept {
  const auto& end_a = a.ends[axis][static_cast<std::size_t>(side)];
  const auto& end_b = b.ends[axis][static_cast<std::size_t>(side)];
  if (!touching_) return std::max(end_a.gap, end_b.gap) + deviation_m;
  const double same_as_a = std::max(end_a.gap, gap_of(axes_[axis], side, end_a, b.view));
  const double same_as_b = std::max(end_b.gap, gap_of(axes_[axis], side, end_b, a.view));
  return std::min(same_as_a, same_as_b) + deviation_m;
}

bool Separation::certainly_stays(const Sample& a, const Sample& b, bool member) const noexcept {
  const double h_s = static_cast<double>(b.ns - a.ns) * 1e-9;
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    const int sides = touching_ ? 2 : 1;
    // An axis can prove that the entity stays outside only if it separates them at both ends.
    const auto separates = [&](int side) {
      const auto s = static_cast<std::size_t>(side);
      return a.ends[axis][s].gap > 0.0 && b.ends[axis][s].gap > 0.0;
    };
    if (!member && !separates(0) && !(sides == 2 && separates(1))) continue;
    const AxisBounds bounds = axis_bounds(axis, a, b);
    const double deviation_m = bounds.second_derivative * h_s * h_s / 8.0;
    // An axis of almost zero length proves nothing.
    if ((member ? bounds.max_length : bounds.min_length) <= min_sine) continue;
    for (int side = 0; side < sides; ++side) {
      if (!member &&
          min_gap_m(axis, side, a, b, deviation_m) >= inside_threshold * noise_m_ * bounds.max_length)
        return true;
      if (member &&
          max_gap_m(axis, side, a, b, deviation_m) > outside_threshold * noise_m_ * bounds.min_length)
        return false;
    }
  }
  return member;
}

}  // namespace rtstdb::standing
