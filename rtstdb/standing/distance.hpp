#pragma once
// Squared distances between an entity and a point, both moving, and two border functions for crossing.hpp:
// whether an entity is within a radius, and which of two entities is nearer. A squared distance has a
// continuous derivative, to a box too. Over an interval of length h it is at most `below` h^2 / 8 below its
// chord, and at most `above` h^2 / 8 above it.
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

  struct Sample {
    std::int64_t ns = 0;
    RelativeMotion::View view;
    glm::dvec3 from_center_m{0.0};  ///< from the box's centre to the point, in the box's axes
    double value_m2 = 0.0;
  };
  Sample at(std::int64_t ns) const noexcept;
  /// The squared distance at `sample` to the corner that is farthest at `chosen_at`.
  double value_of_same_corner_m2(const Sample& sample, const Sample& chosen_at) const noexcept;
  Measure measure() const noexcept { return measure_; }

  /// Bounds of the second derivative that limit the distance from the chord.
  struct ChordDeviation {
    double below = 0.0, above = 0.0;  ///< m^2 / s^2
  };
  ChordDeviation chord_deviation(const Sample& a, const Sample& b) const noexcept;
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
        in_m2_((radius_m + inside_threshold * noise_m) * (radius_m + inside_threshold * noise_m)),
        border_m2_((radius_m + border_threshold * noise_m) * (radius_m + border_threshold * noise_m)),
        out_m2_((radius_m + outside_threshold * noise_m) * (radius_m + outside_threshold * noise_m)) {}

  using Sample = SquaredDistance::Sample;
  Sample at(std::int64_t ns) const noexcept { return distance_.at(ns); }
  bool inside(const Sample& sample) const noexcept { return sample.value_m2 <= border_m2_; }
  bool has_crossed(const Sample& sample, bool member) const noexcept {
    return member ? sample.value_m2 > out_m2_ : sample.value_m2 < in_m2_;
  }
  bool certainly_stays(const Sample& a, const Sample& b, bool member) const noexcept;

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

  struct Sample {
    std::int64_t ns = 0;
    SquaredDistance::Sample challenger, holder;
    double value_m2 = 0.0;
    double noise_m2 = 0.0;
  };
  Sample at(std::int64_t ns) const noexcept;
  bool inside(const Sample& sample) const noexcept { return sample.value_m2 <= 0.0; }
  bool has_crossed(const Sample& sample, bool member) const noexcept {
    return member ? sample.value_m2 > sample.noise_m2 : sample.value_m2 < -sample.noise_m2;
  }
  bool certainly_stays(const Sample& a, const Sample& b, bool member) const noexcept;

 private:
  const SquaredDistance& challenger_;
  const SquaredDistance& holder_;
  double bias_m2_;
  double noise_m_;
};

}  // namespace rtstdb::standing
