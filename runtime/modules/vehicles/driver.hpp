#pragma once
// The acceleration of a driver on a straight lane: the Intelligent Driver Model (Treiber, Hennecke,
// Helbing, Phys. Rev. E 62, 2000). A stop line is a leader at rest.

namespace hil::modules {

struct DriverModel {
  double desired_speed_mps = 13.9;
  double acceleration_mps2 = 1.5;  ///< from rest
  double comfortable_mps2 = 2.5;   ///< preferred deceleration
  double headway_s = 1.2;
  double standstill_gap_m = 2.0;
};

/// The leader: its rear edge is `gap_m` ahead of the front edge and moves at `speed_mps`. Default: none.
struct Ahead {
  double gap_m = 1e9;
  double speed_mps = 0.0;
};

/// IDM acceleration at `speed_mps` behind `ahead`. Never below -max_deceleration_mps2, which a gap at or
/// below zero gives.
double idm_acceleration(const DriverModel& driver, double speed_mps, const Ahead& ahead,
                        double max_deceleration_mps2) noexcept;

/// Whether a car can stop at a line `distance_m` ahead with at most `deceleration_mps2`.
bool can_stop(double speed_mps, double distance_m, double deceleration_mps2) noexcept;

/// Exact distance and speed after `dt_s` at constant acceleration. A car that comes to rest stays at rest.
struct Travel {
  double distance_m = 0.0;
  double speed_mps = 0.0;
};
Travel travel(double speed_mps, double acceleration_mps2, double dt_s) noexcept;

}  // namespace hil::modules
