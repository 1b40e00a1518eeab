#pragma once
// The motion of one rigid body relative to another; both move as rows do, with constant linear and angular
// velocity.
//
// A point r of the body `target` is, in the frame of the body `observer`, at
//     y(t) = R_observer^T (D + R_target r),   D = p_target - p_observer, which is linear in t
// and with v = D', w = w_target, u = w_observer (all constant in the world)
//     y'  = R_observer^T (v - u x D + (w - u) x R_target r)
//     y'' = R_observer^T (K R_target r + A),   K = [w]^2 - 2 [u][w] + [u]^2, A = -2 u x v + u x (u x D)
// where [x] is the matrix of the cross product with x. K is zero if both bodies rotate alike, A if `observer`
// does not rotate. D is linear in t, and so is A; the lengths of both are largest at an end of an interval.
//
// Threads: pure; no allocation.

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>

#include <rtstdb/entity.hpp>

namespace rtstdb::standing {

/// A point fixed to a body. If the body does not rotate, the motion is moved to the point and the offset is
/// zero, since short levers give tighter bounds.
struct PointOnBody {
  Motion motion;
  glm::dvec3 offset_m{0.0};
};
PointOnBody point_on_body(const Motion& motion, const glm::dvec3& offset_m) noexcept;

class RelativeMotion {
 public:
  RelativeMotion(const Motion& target, const Motion& observer) noexcept;

  /// The relative pose at an instant.
  struct View {
    std::int64_t ns = 0;
    glm::dvec3 apart_m{0.0};   ///< D, world axes
    glm::dvec3 offset_m{0.0};  ///< origin of `target` in `observer`
    glm::dmat3 rotation{1.0};  ///< axes of `target` in `observer`
  };
  View at(std::int64_t ns) const noexcept;

  /// Bounds for all points of one body within an interval, in the frame of the other body.
  struct Bounds {
    double speed_mps = 0.0;
    double acceleration_mps2 = 0.0;
  };
  /// For points of `target` at most lever_m from its origin, in the frame of `observer`.
  Bounds target_bounds(const View& a, const View& b, double lever_m) const noexcept;
  /// For points of `observer`, in the frame of `target`.
  Bounds observer_bounds(const View& a, const View& b, double lever_m) const noexcept;
  /// Bound of |n . y''| for such points, where n is a unit vector fixed in the frame of the other body.
  double target_acceleration(const View& a, const View& b, const glm::dvec3& n,
                             double lever_m) const noexcept;
  double observer_acceleration(const View& a, const View& b, const glm::dvec3& n,
                               double lever_m) const noexcept;

  /// Bounds of |e'| and |e''| for a unit vector e fixed in `target`, in the frame of `observer`.
  struct DirectionBounds {
    double rate = 0.0;
    double second_derivative = 0.0;
  };
  DirectionBounds direction_bounds(const glm::dvec3& e) const noexcept;

  /// Rounding error of a point of either body within lever_m, in the frame of the other, over the interval.
  double noise_m(std::int64_t first_ns, std::int64_t last_ns, double lever_m) const noexcept;

  const glm::dvec3& velocity_mps() const noexcept { return v_; }

 private:
  /// Terms of the second derivative of one body in the frame of the other.
  struct FrameTerms {
    glm::dvec3 u{0.0};        ///< angular velocity of the body whose frame is used
    glm::dvec3 v{0.0};        ///< velocity of the other body relative to it
    glm::dvec3 u_local{0.0};  ///< direction of u in that frame; zero if it does not rotate
    glm::dmat3 q{1.0};        ///< axes of that frame in the world, if it does not rotate
    glm::dmat3 k{0.0};
    double k_norm = 0.0;
    double k_along_u = 0.0;  ///< |K^T u / |u||
  };
  static FrameTerms frame_terms(const Motion& body, const Motion& frame) noexcept;
  static double acceleration_along(const FrameTerms& terms, const glm::dvec3& apart_a_m,
                                   const glm::dvec3& apart_b_m, const glm::dvec3& n, double lever_m) noexcept;
  static Bounds bounds(const FrameTerms& terms, double turning, const glm::dvec3& apart_a_m,
                       const glm::dvec3& apart_b_m, double lever_m) noexcept;

  Motion target_, observer_;
  glm::dvec3 v_{0.0};
  glm::dvec3 turning_{0.0};  ///< w - u
  double turning_radps_ = 0.0;
  FrameTerms target_terms_, observer_terms_;
  glm::dvec3 w_local_{0.0};  ///< direction of w in the frame of `target`
  glm::dmat3 q_target_{1.0};
};

}  // namespace rtstdb::standing
