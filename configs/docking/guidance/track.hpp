#pragma once
// The estimate of the capsule's position and velocity: a Kalman filter for each axis of the station frame,
// with the commanded acceleration as its input.
//
// SI units. Threads: one.

#include <glm/ext/vector_double3.hpp>

#include <array>

namespace hil::docking::guidance {

class Track {
 public:
  /// Starts at a position, with an unknown velocity of this standard deviation.
  void begin(const glm::dvec3& p_m, double sigma_m, double sigma_mps);
  /// `a_mps2`: the acceleration in the time that has passed.
  void predict(double dt_s, const glm::dvec3& a_mps2);
  /// A position that was measured `age_s` ago.
  void update(const glm::dvec3& p_m, double sigma_m, double age_s);

  glm::dvec3 p_m() const;
  glm::dvec3 v_mps() const;
  double sigma_m() const;  ///< the largest of the three axes

 private:
  struct Axis {
    double p = 0.0, v = 0.0;
    double pp = 0.0, pv = 0.0, vv = 0.0;  ///< covariance
  };
  std::array<Axis, 3> axes_;
};

}  // namespace hil::docking::guidance
