#pragma once
// An object as a list of the scanner reports it. Axes as in controller.hpp.

namespace hil::crossing::aeb {

/// An object `age_s` before its list was received, in the ego's axes of that instant.
struct ObjectReport {
  bool valid = false;
  double x_m = 0.0;  ///< its centre
  double y_m = 0.0;
  double velocity_x_mps = 0.0;
  double velocity_y_mps = 0.0;
  double length_m = 0.0;  ///< along its velocity
  double age_s = 0.0;

  bool operator==(const ObjectReport&) const = default;
};

}  // namespace hil::crossing::aeb
