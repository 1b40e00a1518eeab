#pragma once
// The signed distance between an entity's box (or its centre) and a convex body, both moving, for the tests
// touching and inside: a border function for crossing.hpp.
//
// touching: separating axis theorem (Gottschalk et al., "OBBTree", 1996). Along an axis, the gap between body
// and box is the smallest difference of two of their corners. They touch if no axis separates them; the axes
// are the normals of the faces of both and the products of their edges.
// inside: every corner is behind every face; the farthest corner decides.
// Along each axis, the difference of two corners is a smooth function of time. Over an interval of length h
// it is at most bend h^2 / 8 away from its chord, where a bound limits its second derivative.
//
// Threads: pure; no allocation.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstdint>

#include <rtstdb/query.hpp>

#include "rtstdb/standing/convex_body.hpp"
#include "rtstdb/standing/relative_motion.hpp"

namespace rtstdb::standing {

/// Thresholds in units of the noise. A body that touches is inside, so the border has a thickness: below
/// inside_threshold an entity is inside, above outside_threshold outside, and in between its state does not
/// change. border_threshold separates the two sides.
inline constexpr double inside_threshold = 1.0, border_threshold = 1.5, outside_threshold = 2.0;

/// Scaled bounds of an entity in its frame. is_point: only its centre is tested, and the half extents are
/// zero.
struct EntityBox {
  glm::dvec3 center_m{0.0};
  glm::dvec3 half_extent_m{0.0};
  bool is_point = false;
  double reach_m() const noexcept;
};

class Separation {
 public:
  /// `motion`: the entity relative to the frame of the body.
  Separation(const RelativeMotion& motion, const ConvexBody& body, const EntityBox& entity, RegionTest test,
             double noise_m) noexcept;

  struct Sample {
    std::int64_t ns = 0;
    RelativeMotion::View view;
    double worst_m = 0.0;  ///< the largest gap over all axes
    /// Length of each axis; not 1 for products of edges.
    std::array<double, 26> length;
    struct Corners {
      double gap = 0.0;         ///< times the length of the axis
      std::uint8_t entity = 0;  ///< corner of the box; bit i: on the positive side of its axis i
      std::uint8_t body = 0;
    };
    std::array<std::array<Corners, 2>, 26> ends;  ///< along the axis and against it
  };
  Sample at(std::int64_t ns) const noexcept;
  bool inside(const Sample& sample) const noexcept { return sample.worst_m <= border_threshold * noise_m_; }
  bool has_crossed(const Sample& sample, bool member) const noexcept {
    return member ? sample.worst_m > outside_threshold * noise_m_
                  : sample.worst_m < inside_threshold * noise_m_;
  }
  bool certainly_stays(const Sample& a, const Sample& b, bool member) const noexcept;

 private:
  struct Axis {
    enum class Kind : std::uint8_t { body, entity, product } kind;
    std::uint8_t first = 0, second = 0;
  };
  struct AxisBounds {
    double second_derivative = 0.0;
    double min_length = 1.0, max_length = 1.0;  ///< of the axis, within the interval
  };
  glm::dvec3 direction(const Axis& axis, const RelativeMotion::View& view) const noexcept;
  glm::dvec3 entity_corner_m(const RelativeMotion::View& view, std::uint8_t corner) const noexcept;
  double gap_of(const Axis& axis, int sign, const Sample::Corners& corners,
                const RelativeMotion::View& view) const noexcept;
  AxisBounds axis_bounds(std::size_t axis, const Sample& a, const Sample& b) const noexcept;
  /// Lower and upper bound of the gap along one axis within the interval.
  double min_gap_m(std::size_t axis, int side, const Sample& a, const Sample& b,
                   double deviation_m) const noexcept;
  double max_gap_m(std::size_t axis, int side, const Sample& a, const Sample& b,
                   double deviation_m) const noexcept;

  const RelativeMotion& motion_;
  const ConvexBody& body_;
  EntityBox entity_;
  bool touching_;
  double noise_m_;
  double entity_reach_m_;
  FixedVector<Axis, 26> axes_;
};

}  // namespace rtstdb::standing
