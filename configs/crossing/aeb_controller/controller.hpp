#pragma once
// The decisions of an emergency-braking controller: whether the ego car meets an object if both keep their
// velocities, and which deceleration avoids it. While the object list is frozen (plausibility_check.hpp), the
// places of the objects are unknown, and the controller stops the car. It uses no bus and no clock: results
// depend only on the calls and the times that they give.
//
// Axes: x forward, y left; the origin is the middle of the ego's front bumper. Velocities are over ground, in
// these axes. Times are nanoseconds of one monotonic clock.
//
// Threads: one.

#include <cstdint>
#include <optional>
#include <span>

#include "configs/crossing/aeb_controller/object_report.hpp"
#include "configs/crossing/aeb_controller/plausibility_check.hpp"

namespace hil::crossing::aeb {

struct EgoState {
  double speed_mps = 0.0;
  double yaw_rate_radps = 0.0;
};

struct BrakeDecision {
  double deceleration_mps2 = 0.0;
  bool warning = false;
  bool degraded = false;  ///< there is no fresh ego state: no deceleration is commanded
};

struct Parameters {
  double ego_half_width_m = 1.0;
  double ego_length_m = 4.5;
  double object_half_width_m = 1.0;
  double lateral_margin_m = 0.4;
  double time_margin_s = 0.4;  ///< by which an object may arrive earlier or leave later than predicted
  double stop_gap_m = 2.0;     ///< distance to the object after the stop
  double horizon_s = 6.0;      ///< later conflicts are ignored

  double warn_demand_mps2 = 1.5;   ///< least required deceleration for a warning
  double brake_demand_mps2 = 3.0;  ///< least required deceleration for braking
  double brake_time_s = 1.2;       ///< a conflict within this time is a reason for braking, too
  double demand_factor =
      1.25;  ///< commanded over required deceleration: the next list may come a second later
  double maximum_deceleration_mps2 = 9.0;

  double standstill_mps = 0.1;
  std::int64_t release_after_ns = 1'000'000'000;  ///< braking ends after this time without a conflict
  std::int64_t ego_timeout_ns = 100'000'000;

  bool checks_plausibility = true;  ///< false: a frozen list counts as any other
  std::int64_t frozen_after_ns = 200'000'000;
  double frozen_deceleration_mps2 = 5.0;  ///< while the list is frozen
};

/// A predicted contact of ego and object if both keep their velocities.
struct Conflict {
  double time_s = 0.0;       ///< until the contact
  double demand_mps2 = 0.0;  ///< required deceleration, stop gap included; may be beyond the limits of a car
};

/// The conflict with an object of age 0; empty: there is none.
std::optional<Conflict> find_conflict(const EgoState& ego, const ObjectReport& object,
                                      const Parameters& parameters);

/// The object at age 0: moved by its velocity, in the ego's axes of now.
ObjectReport extrapolated(const ObjectReport& object, const EgoState& ego);

class Controller {
 public:
  explicit Controller(Parameters parameters = {})
      : parameters_(parameters), plausibility_(parameters.frozen_after_ns) {}

  void ego_status(std::int64_t time_ns, const EgoState& ego);
  /// Takes a complete list of objects. Braking lasts until the ego is at rest or there was no conflict for
  /// release_after_ns; until then the deceleration never decreases. While the list is frozen, it lasts also
  /// at rest.
  BrakeDecision object_list(std::int64_t time_ns, std::span<const ObjectReport> objects);

 private:
  Parameters parameters_;
  PlausibilityCheck plausibility_;
  EgoState ego_;
  std::optional<std::int64_t> ego_time_ns_;
  double latched_mps2_ = 0.0;
  std::int64_t last_conflict_ns_ = 0;
};

}  // namespace hil::crossing::aeb
