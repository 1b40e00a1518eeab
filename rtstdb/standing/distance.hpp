#pragma once
// Squared distances between an entity and a point, both moving, and two Gaps for crossing.hpp: whether an
// entity is within a radius, and which of two entities is nearer. A squared distance has a continuous
// derivative, to a box too. Over an interval of length h it is at most down h^2 / 8 below its chord, and at
// most up h^2 / 8 above it.
//
// Threads: pure; no allocation.

#include <glm/ext/vector_double3.hpp>

#include <cstdint>

#include "rtstdb/standing/relative_motion.hpp"
#include "rtstdb/standing/separation.hpp"

namespace rtstdb::standing {

enum class Measure : std::uint8_t {
  nearest,   ///< to the nearest point of the box; zero inside
  farthest,  ///< to the farthest corner of the box
};

class SquaredDistance {
 public:
  /// `motion`: the entity relative to the frame of the point.
  SquaredDistance(const RelativeMotion& motion, const glm::dvec3& point_m, const EntityBox& entity,
                  Measure measure) noexcept;

  struct Look {
    std::int64_t ns = 0;
    RelativeMotion::View view;
    glm::dvec3 beside_m{0.0};  ///< from the box's centre to the point, in the box's axes
    double value_m2 = 0.0;
  };
  Look at(std::int64_t ns) const noexcept;
  /// The squared distance at `look` to the corner that is farthest at `chosen_at`.
  double value_of_same_corner_m2(const Look& look, const Look& chosen_at) const noexcept;
  Measure measure() const noexcept { return measure_; }

  /// Bounds of the second derivative that limit the distance from the chord.
  struct Leaves {
    double down = 0.0, up = 0.0;  ///< m^2 / s^2
  };
  Leaves leaves(const Look& a, const Look& b) const noexcept;
  double noise_m(std::int64_t first_ns, std::int64_t last_ns) const noexcept;

 private:
  RelativeMotion motion_;
  glm::dvec3 point_m_;
  EntityBox entity_;
  Measure measure_;
  double entity_reach_m_, point_reach_m_;
};

/// Whether the entity is within a radius, border included.
class WithinRadius {
 public:
  WithinRadius(const SquaredDistance& distance, double radius_m, double noise_m) noexcept
      : distance_(distance),
        in_m2_((radius_m + in * noise_m) * (radius_m + in * noise_m)),
        border_m2_((radius_m + border * noise_m) * (radius_m + border * noise_m)),
        out_m2_((radius_m + out * noise_m) * (radius_m + out * noise_m)) {}

  using Look = SquaredDistance::Look;
  Look at(std::int64_t ns) const noexcept { return distance_.at(ns); }
  bool inside(const Look& look) const noexcept { return look.value_m2 <= border_m2_; }
  bool beyond(const Look& look, bool member) const noexcept {
    return member ? look.value_m2 > out_m2_ : look.value_m2 < in_m2_;
  }
  bool stays(const Look& a, const Look& b, bool member) const noexcept;

 private:
  const SquaredDistance& distance_;
  double in_m2_, border_m2_, out_m2_;
};

/// Distances up to this count as zero.
inline constexpr double touching_m = 4e-9;

/// Whether the challenger is nearer than the holder; it is "a member" if it is. If the point touches both
/// (touching_m), the entity with the lower index is nearer.
class Nearer {
 public:
  Nearer(const SquaredDistance& challenger, const SquaredDistance& holder, bool lower_index,
         double noise_m) noexcept
      : challenger_(challenger), holder_(holder), bias_m2_(lower_index ? 4e-18 : 0.0), noise_m_(noise_m) {}

  struct Look {
    std::int64_t ns = 0;
    SquaredDistance::Look challenger, holder;
    double value_m2 = 0.0;
    double noise_m2 = 0.0;
  };
  Look at(std::int64_t ns) const noexcept;
  bool inside(const Look& look) const noexcept { return look.value_m2 <= 0.0; }
  bool beyond(const Look& look, bool member) const noexcept {
    return member ? look.value_m2 > look.noise_m2 : look.value_m2 < -look.noise_m2;
  }
  bool stays(const Look& a, const Look& b, bool member) const noexcept;

 private:
  const SquaredDistance& challenger_;
  const SquaredDistance& holder_;
  double bias_m2_;
  double noise_m_;
};

}  // namespace rtstdb::standing
