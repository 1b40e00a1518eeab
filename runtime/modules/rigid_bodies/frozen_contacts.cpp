#include "runtime/modules/rigid_bodies/frozen_contacts.hpp"

#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace hil::modules {
namespace {

constexpr std::size_t max_points = std::tuple_size_v<decltype(rtstdb::ContactPair::points)>;
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
  points_.reserve(max_points * max_pairs);
  earlier_.reserve(max_points * max_pairs);
  pairs_.reserve(max_pairs);
  earlier_pairs_.reserve(max_pairs);
  stored_.resize(sizes_.size() * sizes_.size());
}

void FrozenContacts::begin() noexcept {
  points_.swap(earlier_);
  points_.clear();
  pairs_.swap(earlier_pairs_);
  pairs_.clear();
}

void FrozenContacts::end() noexcept {
  if (is_first_) {
    for (const Pair& pair : pairs_)
      stored(pair).springs = law_energy(points_of(pair), law_);
  }
  is_first_ = false;
}

void FrozenContacts::begin_pair(std::uint32_t first, std::uint32_t second) noexcept {
  const double m1 = sizes_[first].mass_kg, m2 = sizes_[second].mass_kg;
  const double mass_kg = m1 == 0.0 ? m2 : m2 == 0.0 ? m1 : m1 * m2 / (m1 + m2);
  pairs_.push_back({.first = first,
                    .second = second,
                    .begin = static_cast<std::uint32_t>(points_.size()),
                    .decay_per_s = law_.damping_nspm / mass_kg});
  // Springs without points in the answer before have lost their energy.
  if (was_near(first, second)) return;
  const SpringEnergy springs = stored(pairs_.back()).springs;
  stored(pairs_.back()) = {.springs = {.normal_j = std::min(springs.normal_j, 0.0),
                                       .tangential_j = std::min(springs.tangential_j, 0.0)}};
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
  begin_pair(first, second);
  const double size_first = sizes_[first].diagonal_m, size_second = sizes_[second].diagonal_m;
  for (const rtstdb::ContactPoint& found : pair.contacts()) {
    FrozenContact point;
    point.first = first;
    point.second = second;
    point.normal = glm::normalize(glm::dvec3(found.n_world));
    point.depth_m = static_cast<double>(found.depth_m);
    point.first_arm_m = glm::dvec3(found.p_first_m);
    point.second_arm_m = point.first_arm_m + between_m;
    point.first_weight = size_first < size_second ? 1.0 : size_first > size_second ? 0.0 : 0.5;
    keep_anchor(point);
    points_.push_back(point);
    ++pairs_.back().count;
  }
  return true;
}

void FrozenContacts::keep(std::uint32_t first, std::uint32_t second) noexcept {
  begin_pair(first, second);
  for (const FrozenContact& point : earlier_) {
    if (point.first != first || point.second != second) continue;
    points_.push_back(point);
    ++pairs_.back().count;
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
  point.stretch_m = anchor->stretch_m - glm::dot(anchor->stretch_m, point.normal) * point.normal;
  anchor->first = no_body;  // an anchor belongs to one point
}

bool FrozenContacts::was_near(std::uint32_t first, std::uint32_t second) const noexcept {
  return std::ranges::any_of(earlier_pairs_,
                             [&](const Pair& pair) { return pair.first == first && pair.second == second; });
}

void FrozenContacts::add_load(const FrozenContact& point, std::span<const BodyMotion> bodies,
                              const glm::dvec3& force_n, std::span<BodyLoad> loads) noexcept {
  const BodyMotion& first = bodies[point.first];
  const BodyMotion& second = bodies[point.second];
  const glm::dvec3 place_m = place_of(point, first, second);
  loads[point.first].force_n += force_n;
  loads[point.first].torque_nm += glm::cross(place_m - first.p_m, force_n);
  loads[point.second].force_n -= force_n;
  loads[point.second].torque_nm -= glm::cross(place_m - second.p_m, force_n);
}

void FrozenContacts::add_loads(std::span<const BodyMotion> bodies, std::int64_t time_ns, double dt_s,
                               std::span<BodyLoad> loads, TouchLog& touches) noexcept {
  for (const Pair& pair : pairs_) {
    const BodyMotion& first = bodies[pair.first];
    const BodyMotion& second = bodies[pair.second];
    const std::span<FrozenContact> points = points_of(pair);
    const SpringEnergy begin = law_energy(points, law_);
    for (FrozenContact& point : points) {
      point.velocity_mps = relative_velocity(place_of(point, first, second), first, second);
      advance(point, 0.5 * dt_s);
    }
    set_forces(points, law_, begin, dt_s, pair.decay_per_s, stored(pair));
    for (const FrozenContact& point : points) {
      if (point.mean_depth_m <= 0.0) continue;
      touches.note_first({.first = point.first,
                          .second = point.second,
                          .time_ns = time_ns,
                          .place_m = place_of(point, first, second),
                          .closing_speed_mps = -glm::dot(point.velocity_mps, point.normal),
                          .depth_m = point.mean_depth_m});
      add_load(point, bodies, point.force_n(), loads);
    }
  }
}

bool FrozenContacts::limit(std::span<const BodyMotion> bodies, double dt_s,
                           std::span<BodyLoad> loads) noexcept {
  bool is_limited = false;
  for (const Pair& pair : pairs_) {
    const std::span<FrozenContact> points = points_of(pair);
    std::array<glm::dvec3, max_points> after_mps{};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const BodyMotion& first = bodies[pair.first];
      const BodyMotion& second = bodies[pair.second];
      after_mps[i] = relative_velocity(place_of(points[i], first, second), first, second);
    }
    const double share =
        max_force_share(points, std::span(after_mps).first(points.size()), dt_s, stored(pair));
    if (share == 1.0) continue;
    if (!is_limited) std::fill(loads.begin(), loads.end(), BodyLoad{});
    is_limited = true;
    for (FrozenContact& point : points) {
      add_load(point, bodies, (share - 1.0) * (point.normal_force_n + point.tangential_force_n), loads);
      point.normal_force_n *= share;
      point.tangential_force_n *= share;
    }
  }
  return is_limited;
}

double FrozenContacts::end_substep(std::span<const BodyMotion> bodies, double dt_s) noexcept {
  double work_j = 0.0;
  for (const Pair& pair : pairs_) {
    const BodyMotion& first = bodies[pair.first];
    const BodyMotion& second = bodies[pair.second];
    for (FrozenContact& point : points_of(pair)) {
      const glm::dvec3 place_m = place_of(point, first, second);
      const glm::dvec3 force = point.force_n();
      const auto displacement_of = [&](const BodyMotion& body) {
        return dt_s * (body.v_mps + glm::cross(body.w_radps, place_m - body.p_m));
      };
      if (sizes_[pair.first].mass_kg == 0.0) work_j -= glm::dot(force, displacement_of(first));
      if (sizes_[pair.second].mass_kg == 0.0) work_j += glm::dot(force, displacement_of(second));
      store_work(point, relative_velocity(place_m, first, second), dt_s, stored(pair));
      advance(point, 0.5 * dt_s);
    }
  }
  return work_j;
}

double FrozenContacts::elastic_energy_j() const noexcept {
  double energy_j = 0.0;
  for (const Pair& pair : pairs_) {
    const SpringEnergy& springs = stored_[pair.first * sizes_.size() + pair.second].springs;
    energy_j += std::max(0.0, springs.normal_j) + std::max(0.0, springs.tangential_j);
  }
  return energy_j;
}

}  // namespace hil::modules
