#pragma once
// The contact points of one answer of the contact query, and their forces until the next answer. A point
// keeps the anchor of the nearest point that the same pair had in the answer before, if there is one within
// 2 % of the smaller body's diagonal. A pair that an answer does not decide keeps its earlier points. A pair
// keeps its stored energy (contact_law.hpp) from answer to answer, as long as it has points.
//
// Threads: one. Nothing but the constructor allocates.

#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/contact.hpp>

#include "runtime/modules/rigid_bodies/contact_law.hpp"
#include "runtime/modules/rigid_bodies/touch_log.hpp"

namespace hil::modules {

/// Force and torque about the origin of a body, world axes.
struct BodyLoad {
  glm::dvec3 force_n{0.0};
  glm::dvec3 torque_nm{0.0};
};

struct BodySize {
  double diagonal_m = 0.0;  ///< of the body's box
  double reach_m = 0.0;     ///< from the body's origin to the farthest corner of its box
  double mass_kg = 0.0;     ///< 0: fixed
};

class FrozenContacts {
 public:
  /// `max_pairs`: that an answer lists.
  FrozenContacts(const ContactLaw& law, std::vector<BodySize> sizes, std::uint32_t max_pairs);

  /// Begins the points of a new answer, which add() and keep() then append: those of a pair in a row.
  void begin() noexcept;
  /// False: a point lies beyond a body's reach by more than the margin, so it can not be a contact of that
  /// body; nothing is added.
  bool add(const rtstdb::ContactPair& pair, std::uint32_t first, std::uint32_t second,
           std::span<const BodyMotion> bodies, double margin_m) noexcept;
  /// Appends the points that the pair had in the answer before, if it had any.
  void keep(std::uint32_t first, std::uint32_t second) noexcept;

  /// Whether the answer before the last begin() listed the pair.
  bool was_near(std::uint32_t first, std::uint32_t second) const noexcept;

  /// Completes the points of an answer. The first answer has the springs as the law has them at its depths.
  void end() noexcept;

  /// Updates the points to the middle of a substep of dt_s, at which the bodies are, adds the forces to the
  /// loads, and notes the first contacts.
  void add_loads(std::span<const BodyMotion> bodies, std::int64_t time_ns, double dt_s,
                 std::span<BodyLoad> loads, TouchLog& touches) noexcept;
  /// Reduces the forces of springs that would return more energy than they store. `bodies`: at the middle of
  /// the substep, with the velocities that the loads have given them. The loads are then those that cancel
  /// the rest of the forces. False: no spring does, and the loads are unchanged.
  bool limit(std::span<const BodyMotion> bodies, double dt_s, std::span<BodyLoad> loads) noexcept;
  /// Updates the points to the end of the substep, from the bodies at its middle with the velocities that the
  /// loads have given them, and stores the work that they did against the springs. Returns the work that
  /// fixed bodies did, which move whatever presses them.
  double end_substep(std::span<const BodyMotion> bodies, double dt_s) noexcept;

  /// Energy that the springs of all pairs store.
  double elastic_energy_j() const noexcept;
  std::span<const FrozenContact> points() const noexcept { return points_; }

 private:
  /// The points of a pair, a row of points_.
  struct Pair {
    std::uint32_t first = 0, second = 0;
    std::uint32_t begin = 0, count = 0;
    double decay_per_s = 0.0;  ///< of stored energy beyond that of the law: damping / mass
  };
  void begin_pair(std::uint32_t first, std::uint32_t second) noexcept;
  void keep_anchor(FrozenContact& point) noexcept;
  /// A force at a point on the first body, and the opposite one on the second.
  static void add_load(const FrozenContact& point, std::span<const BodyMotion> bodies,
                       const glm::dvec3& force_n, std::span<BodyLoad> loads) noexcept;
  StoredEnergy& stored(const Pair& pair) noexcept {
    return stored_[pair.first * sizes_.size() + pair.second];
  }
  std::span<FrozenContact> points_of(const Pair& pair) noexcept {
    return std::span(points_).subspan(pair.begin, pair.count);
  }

  const ContactLaw law_;
  const std::vector<BodySize> sizes_;
  std::vector<FrozenContact> points_, earlier_;
  std::vector<Pair> pairs_, earlier_pairs_;
  std::vector<StoredEnergy> stored_;  ///< by first and second body
  bool is_first_ = true;
};

}  // namespace hil::modules
