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

double side_of(int side) noexcept {
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

double Separation::gap_of(const Axis& axis, int side, const Look::Corners& corners,
                          const RelativeMotion::View& view) const noexcept {
  const glm::dvec3 u = direction(axis, view);
  const glm::dvec3 entity_m = entity_corner_m(view, corners.entity);
  if (!touching_) return glm::dot(u, entity_m) - body_.faces[axis.first].offset_m;
  return side_of(side) * glm::dot(u, entity_m - body_.corners_m[corners.body]);
}

Separation::Look Separation::at(std::int64_t ns) const noexcept {
  Look look;
  look.ns = ns;
  look.view = motion_.at(ns);
  look.worst_m = -std::numeric_limits<double>::infinity();
  const glm::dvec3 center_m = look.view.offset_m + look.view.rotation * entity_.center_m;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const Axis& axis = axes_[k];
    const glm::dvec3 u = direction(axis, look.view);
    double extent_m = 0.0;
    std::uint8_t positive = 0;  // the corner of the entity that lies farthest along u
    for (int i = 0; i < 3; ++i) {
      const double along = glm::dot(u, look.view.rotation[i]);
      extent_m += entity_.half_extent_m[i] * std::abs(along);
      if (along >= 0.0) positive = static_cast<std::uint8_t>(positive | 1u << i);
    }
    const double middle_m = glm::dot(u, center_m);
    auto& ends = look.ends[k];
    look.length[k] = axis.kind == Axis::Kind::product ? glm::length(u) : 1.0;
    if (!touching_) {
      ends[0] = {middle_m + extent_m - body_.faces[axis.first].offset_m, positive, 0};
      look.worst_m = std::max(look.worst_m, ends[0].gap);
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
    if (look.length[k] > min_sine)
      look.worst_m = std::max(look.worst_m, std::max(ends[0].gap, ends[1].gap) / look.length[k]);
  }
  return look;
}

Separation::Bend Separation::bend(std::size_t axis, const Look& a, const Look& b) const noexcept {
  const Axis& of = axes_[axis];
  if (of.kind == Axis::Kind::body)
    return {motion_.of_bend(a.view, b.view, direction(of, a.view), entity_reach_m_), 1.0, 1.0};
  if (of.kind == Axis::Kind::entity) {
    glm::dvec3 own(0.0);
    own[of.first] = 1.0;
    return {motion_.from_bend(a.view, b.view, own, body_.reach_m), 1.0, 1.0};
  }
  // The second derivative of (e x b) . (y - s) with constant b and s: its terms contain e'', e' and y''.
  glm::dvec3 edge(0.0);
  edge[of.first] = 1.0;
  const RelativeMotion::Turn turn = motion_.turn(edge);
  const RelativeMotion::Bounds corner = motion_.of_seen(a.view, b.view, entity_reach_m_);
  const double h_s = static_cast<double>(b.ns - a.ns) * 1e-9;
  const double across_m = std::sqrt(std::max(glm::dot(a.view.apart_m, a.view.apart_m),
                                             glm::dot(b.view.apart_m, b.view.apart_m))) +
                          entity_reach_m_ + body_.reach_m;
  const double least = std::min(a.length[axis], b.length[axis]) - turn.rate * h_s;
  const double most = std::min(1.0, std::max(a.length[axis], b.length[axis]) + turn.rate * h_s);
  return {turn.bend * across_m + 2.0 * turn.rate * corner.speed_mps + most * corner.acceleration_mps2,
          std::max(least, 0.0), most};
}

double Separation::least(std::size_t axis, int side, const Look& a, const Look& b,
                         double leaves_m) const noexcept {
  const auto& end_a = a.ends[axis][static_cast<std::size_t>(side)];
  const auto& end_b = b.ends[axis][static_cast<std::size_t>(side)];
  // touching: each corner's gap is at least the smallest one at both ends. inside: the largest gap is at
  // least that of any one corner.
  if (touching_) return std::min(end_a.gap, end_b.gap) - leaves_m;
  const double same_as_a = std::min(end_a.gap, gap_of(axes_[axis], side, end_a, b.view));
  const double same_as_b = std::min(end_b.gap, gap_of(axes_[axis], side, end_b, a.view));
  return std::max(same_as_a, same_as_b) - leaves_m;
}

double Separation::most(std::size_t axis, int side, const Look& a, const Look& b,
                        double leaves_m) const noexcept {
  const auto& end_a = a.ends[axis][static_cast<std::size_t>(side)];
  const auto& end_b = b.ends[axis][static_cast<std::size_t>(side)];
  if (!touching_) return std::max(end_a.gap, end_b.gap) + leaves_m;
  const double same_as_a = std::max(end_a.gap, gap_of(axes_[axis], side, end_a, b.view));
  const double same_as_b = std::max(end_b.gap, gap_of(axes_[axis], side, end_b, a.view));
  return std::min(same_as_a, same_as_b) + leaves_m;
}

bool Separation::stays(const Look& a, const Look& b, bool member) const noexcept {
  const double h_s = static_cast<double>(b.ns - a.ns) * 1e-9;
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    const int sides = touching_ ? 2 : 1;
    // An axis can prove that the entity stays outside only if it separates them at both ends.
    const auto parts = [&](int side) {
      const auto s = static_cast<std::size_t>(side);
      return a.ends[axis][s].gap > 0.0 && b.ends[axis][s].gap > 0.0;
    };
    if (!member && !parts(0) && !(sides == 2 && parts(1))) continue;
    const Bend bends = bend(axis, a, b);
    const double leaves_m = bends.bend * h_s * h_s / 8.0;
    // An axis of almost zero length proves nothing.
    if ((member ? bends.max_length : bends.min_length) <= min_sine) continue;
    for (int side = 0; side < sides; ++side) {
      if (!member && least(axis, side, a, b, leaves_m) >= in * noise_m_ * bends.max_length) return true;
      if (member && most(axis, side, a, b, leaves_m) > out * noise_m_ * bends.min_length) return false;
    }
  }
  return member;
}

}  // namespace rtstdb::standing
