#pragma once
// How far an entity's box, or a point of it, is from touching a convex body or from lying inside it, as both move: a Gap for
// crossing.hpp.
//
// touching: along an axis u a body and a box are apart by the difference of their ends there, which is the least of the differences
// of all their corners. They touch when none of the axes parts them: normals of the faces of both, products of their edges.
// inside: every corner lies behind every face; the farthest corner says.
// Along each axis the difference of two corners is a smooth function of time, and leaves its chord over an interval of length h by
// at most bend h^2 / 8, where bend bounds its second derivative.
//
// Pure: any thread, no allocation.

#include <glm/ext/vector_double3.hpp>

#include <array>
#include <cstdint>

#include <rtstdb/query.hpp>

#include "rtstdb/standing/convex_body.hpp"
#include "rtstdb/standing/relative_motion.hpp"

namespace rtstdb::standing {

/// What touches is in, so the border is some noise thick: who is nearer than the first is in, who is farther than the last is out, and who
/// is in between stays what it was.
inline constexpr double in = 1.0, border = 1.5, out = 2.0;

/// Bounds of an entity in its own frame, scaled; half extents are zero where its centre alone counts.
struct EntityBox {
  glm::dvec3 center_m{0.0};
  glm::dvec3 half_extent_m{0.0};
  bool is_point = false;
  double reach_m() const noexcept;
};

class Separation {
 public:
  /// `motion`: of the entity, seen from the frame of the body.
  Separation(const RelativeMotion& motion, const ConvexBody& body, const EntityBox& entity, RegionTest test,
             double noise_m) noexcept;

  struct Look {
    std::int64_t ns = 0;
    RelativeMotion::View view;
    double worst_m = 0.0;  ///< the largest gap
    /// By axis, which are unit vectors but for products of edges.
    std::array<double, 26> length;
    struct Corners {
      double gap = 0.0;         ///< times the axis' length
      std::uint8_t entity = 0;  ///< bit i: on the positive side of its axis i
      std::uint8_t body = 0;
    };
    std::array<std::array<Corners, 2>, 26> ends;  ///< along the axis, and against it
  };
  Look at(std::int64_t ns) const noexcept;
  bool inside(const Look& look) const noexcept { return look.worst_m <= border * noise_m_; }
  bool beyond(const Look& look, bool member) const noexcept {
    return member ? look.worst_m > out * noise_m_ : look.worst_m < in * noise_m_;
  }
  bool stays(const Look& a, const Look& b, bool member) const noexcept;

 private:
  struct Axis {
    enum class Kind : std::uint8_t { body, entity, product } kind;
    std::uint8_t first = 0, second = 0;
  };
  struct Bend {
    double bend = 0.0;
    double min_length = 1.0, max_length = 1.0;  ///< of the axis within the interval
  };
  glm::dvec3 direction(const Axis& axis, const RelativeMotion::View& view) const noexcept;
  glm::dvec3 entity_corner_m(const RelativeMotion::View& view, std::uint8_t corner) const noexcept;
  double gap_of(const Axis& axis, int sign, const Look::Corners& corners,
                const RelativeMotion::View& view) const noexcept;
  Bend bend(std::size_t axis, const Look& a, const Look& b) const noexcept;
  /// Of the gap along one axis within the interval.
  double least(std::size_t axis, int side, const Look& a, const Look& b, double leaves_m) const noexcept;
  double most(std::size_t axis, int side, const Look& a, const Look& b, double leaves_m) const noexcept;

  const RelativeMotion& motion_;
  const ConvexBody& body_;
  EntityBox entity_;
  bool touching_;
  double noise_m_;
  double entity_reach_m_;
  Few<Axis, 26> axes_;
};

}  // namespace rtstdb::standing
