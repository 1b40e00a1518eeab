#include "runtime/modules/vehicles/driver.hpp"

#include <algorithm>
#include <cmath>

namespace hil::modules {

double idm_acceleration(const DriverModel& driver, double speed_mps, const Ahead& ahead,
                        double max_deceleration_mps2) noexcept {
  constexpr double no_leader_m = 1000.0;
  const double free_road = 1.0 - std::pow(speed_mps / driver.desired_speed_mps, 4.0);
  const double closing = speed_mps - ahead.speed_mps;
  const double wanted_gap =
      driver.standstill_gap_m +
      std::max(0.0, speed_mps * driver.headway_s +
                        speed_mps * closing /
                            (2.0 * std::sqrt(driver.acceleration_mps2 * driver.comfortable_mps2)));
  if (ahead.gap_m <= 0.0) return -max_deceleration_mps2;
  // Without a leader a car at its desired speed keeps it exactly.
  if (ahead.gap_m > no_leader_m)
    return std::max(driver.acceleration_mps2 * free_road, -max_deceleration_mps2);
  const double interaction = wanted_gap / ahead.gap_m;
  return std::max(driver.acceleration_mps2 * (free_road - interaction * interaction), -max_deceleration_mps2);
}

bool can_stop(double speed_mps, double distance_m, double deceleration_mps2) noexcept {
  return distance_m > 0.0 && speed_mps * speed_mps <= 2.0 * deceleration_mps2 * distance_m;
}

Travel travel(double speed_mps, double acceleration_mps2, double dt_s) noexcept {
  const double speed_after = speed_mps + acceleration_mps2 * dt_s;
  if (speed_after >= 0.0) return {0.5 * (speed_mps + speed_after) * dt_s, speed_after};
  // At rest after speed / |acceleration|.
  return {0.5 * speed_mps * speed_mps / -acceleration_mps2, 0.0};
}

}  // namespace hil::modules
