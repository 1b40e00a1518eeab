#pragma once
// One rigid body seen from another: both move as rows do, linearly and with a constant angular velocity each.
//
// A point r of `of` stands in the frame of `from` at
//     y(t) = R_from^T (D + R_of r),   D = p_of - p_from, which is linear in t
// and with v = D', w = w_of, u = w_from (all constant in the world)
//     y'  = R_from^T (v - u x D + (w - u) x R_of r)
//     y'' = R_from^T (K R_of r + A),   K = [w]^2 - 2 [u][w] + [u]^2,   A = -2 u x v + u x (u x D)
// where [x] is the matrix of x cross. K is zero for bodies that turn alike, A for a `from` that does not turn. Since D is linear in t,
// so is A, and the lengths of both are largest at an end of an interval.
//
// Pure: any thread, no allocation.

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>

#include <rtstdb/entity.hpp>

namespace rtstdb::standing {

/// A point that a body carries, in its frame: the motion with its origin moved there where that is as well rigid motion, as it is for
/// a body that does not turn. Levers are short then.
struct Carried {
  Motion motion;
  glm::dvec3 offset_m{0.0};
};
Carried carried(const Motion& motion, const glm::dvec3& offset_m) noexcept;

class RelativeMotion {
 public:
  RelativeMotion(const Motion& of, const Motion& from) noexcept;

  /// An instant.
  struct View {
    std::int64_t ns = 0;
    glm::dvec3 apart_m{0.0};   ///< D, world axes
    glm::dvec3 offset_m{0.0};  ///< origin of `of` in `from`
    glm::dmat3 rotation{1.0};  ///< axes of `of` in `from`
  };
  View at(std::int64_t ns) const noexcept;

  /// What holds for all points of one body within the interval, seen from the other.
  struct Bounds {
    double speed_mps = 0.0;
    double acceleration_mps2 = 0.0;
  };
  /// Points of `of` at most lever_m from its origin, seen from `from`.
  Bounds of_seen(const View& a, const View& b, double lever_m) const noexcept;
  /// Points of `from`, seen from `of`.
  Bounds from_seen(const View& a, const View& b, double lever_m) const noexcept;
  /// |n . y''| of such points, n being a unit vector that is fixed in the frame they are seen from.
  double of_bend(const View& a, const View& b, const glm::dvec3& n, double lever_m) const noexcept;
  double from_bend(const View& a, const View& b, const glm::dvec3& n, double lever_m) const noexcept;

  /// Of a unit vector e fixed in `of`, seen from `from`: bounds of |e'| and |e''|.
  struct Turn {
    double rate = 0.0;
    double bend = 0.0;
  };
  Turn turn(const glm::dvec3& e) const noexcept;

  /// How well a point of either body within the levers is known where the other sees it, up to that time.
  double noise_m(std::int64_t first_ns, std::int64_t last_ns, double lever_m) const noexcept;

  const glm::dvec3& velocity_mps() const noexcept { return v_; }

 private:
  /// What bends the view of one body from the other.
  struct Side {
    glm::dvec3 u{0.0};        ///< w of the body that looks on
    glm::dvec3 v{0.0};        ///< of the other, relative to it
    glm::dvec3 u_local{0.0};  ///< direction of u in its own frame; zero where it does not turn
    glm::dmat3 q{1.0};        ///< its axes in the world where it does not turn
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
  glm::dvec3 w_local_{0.0};  ///< direction of w in `of`
  glm::dmat3 q_of_{1.0};
};

}  // namespace rtstdb::standing
