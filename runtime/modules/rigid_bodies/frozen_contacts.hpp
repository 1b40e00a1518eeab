#pragma once
// The contact points of one answer of the contact query, and their forces until the next answer. A point
// keeps the anchor of the nearest point that the same pair had in the answer before, if there is one within
// 2 % of the smaller body's diagonal. A pair that an answer does not decide keeps its earlier points.
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
  /// Appends the points that the pair had in the answer before.
  void keep(std::uint32_t first, std::uint32_t second) noexcept;

  /// Whether the answer before the last begin() had points of the pair. Before the pair is added.
  bool was_near(std::uint32_t first, std::uint32_t second) const noexcept;

  /// Begins a substep of dt_s at a run time: updates the points by the motion of the substep before, adds the
  /// forces to the loads, and notes the first contacts.
  void add_loads(std::span<const BodyMotion> bodies, std::int64_t time_ns, double dt_s,
                 std::span<BodyLoad> loads, TouchLog& touches) noexcept;

  std::span<const FrozenContact> points() const noexcept { return points_; }

 private:
  void keep_anchor(FrozenContact& point) noexcept;

  const ContactLaw law_;
  const std::vector<BodySize> sizes_;
  std::vector<FrozenContact> points_, earlier_;
  bool depths_are_known_ = false;
};

}  // namespace hil::modules
