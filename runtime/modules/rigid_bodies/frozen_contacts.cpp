#include "runtime/modules/rigid_bodies/frozen_contacts.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <utility>

namespace hil::modules {
namespace {

constexpr std::size_t points_per_pair = std::tuple_size_v<decltype(rtstdb::ContactPair::points)>;
/// An anchor is kept by a point whose place on the body differs by less than this share of the smaller body's
/// diagonal.
constexpr double anchor_reach = 0.02;
constexpr std::uint32_t no_body = std::numeric_limits<std::uint32_t>::max();

/// The place of the point on the body with which it moves.
glm::dvec3 arm_of(const FrozenContact& point) {
  return point.first_weight >= 0.5 ? point.first_arm_m : point.second_arm_m;
}

}  // namespace

FrozenContacts::FrozenContacts(const ContactLaw& law, std::vector<BodySize> sizes, std::uint32_t max_pairs)
    : law_(law), sizes_(std::move(sizes)) {
  points_.reserve(points_per_pair * max_pairs);
  earlier_.reserve(points_per_pair * max_pairs);
}

void FrozenContacts::begin() noexcept {
  points_.swap(earlier_);
  points_.clear();
  depths_are_known_ = true;
}

bool FrozenContacts::add(const rtstdb::ContactPair& pair, std::uint32_t first, std::uint32_t second,
                         std::span<const BodyMotion> bodies, double margin_m) noexcept {
  const glm::dvec3 between_m = bodies[first].p_m - bodies[second].p_m;
  for (const rtstdb::ContactPoint& found : pair.contacts()) {
    const glm::dvec3 arm_m(found.p_first_m);
    if (glm::length(arm_m) > sizes_[first].reach_m + margin_m ||
        glm::length(arm_m + between_m) > sizes_[second].reach_m + margin_m)
      return false;
  }
  const double size_first = sizes_[first].diagonal_m, size_second = sizes_[second].diagonal_m;
  for (const rtstdb::ContactPoint& found : pair.contacts()) {
    FrozenContact point;
    point.first = first;
    point.second = second;
    point.normal = glm::normalize(glm::dvec3(found.n_world));
    point.depth_m = static_cast<double>(found.depth_m);
    point.share = 1.0 / static_cast<double>(pair.point_count);
    point.first_arm_m = glm::dvec3(found.p_first_m);
    point.second_arm_m = point.first_arm_m + between_m;
    point.first_weight = size_first < size_second ? 1.0 : size_first > size_second ? 0.0 : 0.5;
    keep_anchor(point);
    points_.push_back(point);
  }
  return true;
}

void FrozenContacts::keep(std::uint32_t first, std::uint32_t second) noexcept {
  for (FrozenContact& point : earlier_) {
    if (point.first != first || point.second != second || points_.size() == points_.capacity()) continue;
    points_.push_back(point);
    points_.back().is_new = false;
    points_.back().is_kept = true;
    point.first = no_body;
  }
}

void FrozenContacts::keep_anchor(FrozenContact& point) noexcept {
  double nearest_m = anchor_reach * std::min(sizes_[point.first].diagonal_m, sizes_[point.second].diagonal_m);
  FrozenContact* anchor = nullptr;
  for (FrozenContact& before : earlier_) {
    if (before.first != point.first || before.second != point.second) continue;
    const double distance_m = glm::distance(arm_of(before), arm_of(point));
    if (distance_m >= nearest_m) continue;
    nearest_m = distance_m;
    anchor = &before;
  }
  if (anchor == nullptr) return;
  point.is_new = false;
  point.stretch_m = anchor->stretch_m - glm::dot(anchor->stretch_m, point.normal) * point.normal;
  anchor->first = no_body;  // an anchor belongs to one point
}

bool FrozenContacts::was_near(std::uint32_t first, std::uint32_t second) const noexcept {
  return std::ranges::any_of(
      earlier_, [&](const FrozenContact& point) { return point.first == first && point.second == second; });
}

void FrozenContacts::add_loads(std::span<const BodyMotion> bodies, std::int64_t time_ns, double dt_s,
                               std::span<BodyLoad> loads, TouchLog& touches) noexcept {
  for (FrozenContact& point : points_) {
    const BodyMotion& first = bodies[point.first];
    const BodyMotion& second = bodies[point.second];
    const glm::dvec3 place_m = place_of(point, first, second);
    const glm::dvec3 velocity = relative_velocity(place_m, first, second);
    const bool depth_is_known = depths_are_known_ && !point.is_kept;
    if (!depths_are_known_ || !point.is_new) follow(point, velocity, dt_s, depth_is_known);
    if (point.depth_m > 0.0) {
      touches.note_first({.first = point.first,
                          .second = point.second,
                          .time_ns = time_ns,
                          .place_m = place_m,
                          .closing_speed_mps = -glm::dot(velocity, point.normal),
                          .depth_m = point.depth_m});
    }
    const glm::dvec3 force = contact_force(point, law_, velocity);
    loads[point.first].force_n += force;
    loads[point.first].torque_nm += glm::cross(place_m - first.p_m, force);
    loads[point.second].force_n -= force;
    loads[point.second].torque_nm -= glm::cross(place_m - second.p_m, force);
  }
  depths_are_known_ = false;
}

}  // namespace hil::modules
