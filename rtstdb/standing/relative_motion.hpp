#pragma once
// The motion of one rigid body relative to another; both move as rows do, with constant linear and angular
// velocity.
//
// A point r of the body `of` is, in the frame of the body `from`, at
//     y(t) = R_from^T (D + R_of r),   D = p_of - p_from, which is linear in t
// and with v = D', w = w_of, u = w_from (all constant in the world)
//     y'  = R_from^T (v - u x D + (w - u) x R_of r)
//     y'' = R_from^T (K R_of r + A),   K = [w]^2 - 2 [u][w] + [u]^2, A = -2 u x v + u x (u x D)
// where [x] is the matrix of the cross product with x. K is zero if both bodies rotate alike, A if `from`
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
struct Carried {
  Motion motion;
  glm::dvec3 offset_m{0.0};
};
Carried carried(const Motion& motion, const glm::dvec3& offset_m) noexcept;

class RelativeMotion {
 public:
  RelativeMotion(const Motion& of, const Motion& from) noexcept;

  /// The relative pose at an instant.
  struct View {
    std::int64_t ns = 0;
    glm::dvec3 apart_m{0.0};   ///< D, world axes
    glm::dvec3 offset_m{0.0};  ///< origin of `of` in `from`
    glm::dmat3 rotation{1.0};  ///< axes of `of` in `from`
  };
  View at(std::int64_t ns) const noexcept;

  /// Bounds for all points of one body within an interval, in the frame of the other body.
  struct Bounds {
    double speed_mps = 0.0;
    double acceleration_mps2 = 0.0;
  };
  /// For points of `of` at most lever_m from its origin, in the frame of `from`.
  Bounds of_seen(const View& a, const View& b, double lever_m) const noexcept;
  /// For points of `from`, in the frame of `of`.
  Bounds from_seen(const View& a, const View& b, double lever_m) const noexcept;
  /// Bound of |n . y''| for such points, where n is a unit vector fixed in the frame of the other body.
  double of_bend(const View& a, const View& b, const glm::dvec3& n, double lever_m) const noexcept;
  double from_bend(const View& a, const View& b, const glm::dvec3& n, double lever_m) const noexcept;

  /// Bounds of |e'| and |e''| for a unit vector e fixed in `of`, in the frame of `from`.
  struct Turn {
    double rate = 0.0;
    double bend = 0.0;
  };
  Turn turn(const glm::dvec3& e) const noexcept;

  /// Rounding error of a point of either body within lever_m, in the frame of the other, over the interval.
  double noise_m(std::int64_t first_ns, std::int64_t last_ns, double lever_m) const noexcept;

  const glm::dvec3& velocity_mps() const noexcept { return v_; }

 private:
  /// Terms of the second derivative of one body in the frame of the other.
  struct Side {
    glm::dvec3 u{0.0};        ///< angular velocity of the body whose frame is used
    glm::dvec3 v{0.0};        ///< velocity of the other body relative to it
    glm::dvec3 u_local{0.0};  ///< direction of u in that frame; zero if it does not rotate
    glm::dmat3 q{1.0};        ///< axes of that frame in the world, if it does not rotate
    glm::dmat3 k{0.0};
    double k_norm = 0.0;
    double k_along_u = 0.0;  ///< |K^T u / |u||
  };
  static Side side_of(const Motion& seen, const Motion& from) noexcept;
  static double bend(const Side& side, const glm::dvec3& apart_a_m, const glm::dvec3& apart_b_m,
                     const glm::dvec3& n, double lever_m) noexcept;
  static Bounds bounds(const Side& side, double turning, const glm::dvec3& apart_a_m,
                       const glm::dvec3& apart_b_m, double lever_m) noexcept;

  Motion of_, from_;
  glm::dvec3 v_{0.0};
  glm::dvec3 turning_{0.0};  ///< w - u
  double turning_radps_ = 0.0;
  Side seen_from_, seen_of_;
  glm::dvec3 w_local_{0.0};  ///< direction of w in the frame of `of`
  glm::dmat3 q_of_{1.0};
};

}  // namespace rtstdb::standing
