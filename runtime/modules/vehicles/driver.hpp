#pragma once
// How a driver accelerates along a straight lane: the Intelligent Driver Model (Treiber, Hennecke, Helbing,
// Phys. Rev. E 62, 2000), with a stop line as a standing leader, and a first-order brake actuator.

namespace hil::modules {

struct DriverModel {
  double desired_speed_mps = 13.9;
  double acceleration_mps2 = 1.5;  ///< from rest
  double comfortable_mps2 = 2.5;   ///< deceleration a driver likes
  double headway_s = 1.2;
  double standstill_gap_m = 2.0;
};

/// Something ahead on the lane: its rear edge, `gap_m` ahead of the front edge, moving at `speed_mps`.
struct Ahead {
  double gap_m = 1e9;
  double speed_mps = 0.0;
};

/// IDM acceleration at `speed_mps` behind `ahead`. Finite for every gap; a gap at or below zero brakes as
/// hard as `hardest_mps2`.
double idm_acceleration(const DriverModel& driver, double speed_mps, const Ahead& ahead,
                        double hardest_mps2) noexcept;

/// Whether a car can still stop at a line `distance_m` ahead with at most `deceleration_mps2`.
bool can_stop(double speed_mps, double distance_m, double deceleration_mps2) noexcept;

/// Position and speed after `dt_s` at constant acceleration, exact, never rolling backward: a car that comes
/// to rest within the step stays there.
struct Travel {
  double distance_m = 0.0;
  double speed_mps = 0.0;
};
Travel travel(double speed_mps, double acceleration_mps2, double dt_s) noexcept;

}  // namespace hil::modules
