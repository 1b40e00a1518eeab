#pragma once
// The judgement of an emergency-braking controller: will the ego car meet an object if both keep their speed,
// and does it take hard braking to stop before? Knows no bus. Every result is a function of the calls and the
// times given with them.
//
// Axes: x forward, y left; the origin is the middle of the ego's front bumper. Velocities are over ground, in
// these axes. Times are nanoseconds of any one clock that never goes back.
//
// Threads: one.

#include <cstdint>
#include <optional>
#include <span>

namespace hil::crossing::aeb {

struct EgoState {
  double speed_mps = 0.0;
  double yaw_rate_radps = 0.0;
};

/// An object as it was, in the ego's axes as they were, `age_s` before the list came.
struct ObjectReport {
  bool valid = false;
  double x_m = 0.0;  ///< its centre
  double y_m = 0.0;
  double velocity_x_mps = 0.0;
  double velocity_y_mps = 0.0;
  double length_m = 0.0;  ///< along its velocity
  double age_s = 0.0;
};

struct BrakeDecision {
  double deceleration_mps2 = 0.0;
  bool warning = false;
  bool degraded = false;  ///< no fresh ego state: nothing is commanded
};

struct Parameters {
  double ego_half_width_m = 1.0;
  double ego_length_m = 4.5;
  double object_half_width_m = 1.0;
  double lateral_margin_m = 0.4;
  double time_margin_s = 0.4;  ///< by which an object may come earlier or leave later than predicted
  double stop_gap_m = 2.0;     ///< left free before the object
  double horizon_s = 6.0;      ///< conflicts later than this are none of ours yet

  double warn_demand_mps2 = 1.5;   ///< needed deceleration from which the driver is warned
  double brake_demand_mps2 = 3.0;  ///< from which the car is braked
  double brake_time_s = 1.2;       ///< or a conflict this near
  double demand_factor = 1.25;     ///< commanded over needed: the next list may be a second away
  double maximum_deceleration_mps2 = 9.0;

  double standstill_mps = 0.1;
  std::int64_t release_after_ns = 1'000'000'000;  ///< of no conflict
  std::int64_t ego_timeout_ns = 100'000'000;
};

/// What keeping speed leads to.
struct Conflict {
  double time_s = 0.0;       ///< until ego and object would touch
  double demand_mps2 = 0.0;  ///< deceleration that avoids it, stop gap included; may exceed any car's
};

/// The conflict with one object measured just now (age 0), if there is one.
std::optional<Conflict> find_conflict(const EgoState& ego, const ObjectReport& object,
                                      const Parameters& parameters);

/// The object moved to now: by its own velocity, and seen from where the ego has driven to.
ObjectReport brought_to_now(const ObjectReport& object, const EgoState& ego);

class Controller {
 public:
  explicit Controller(Parameters parameters = {}) : parameters_(parameters) {}

  void ego_status(std::int64_t time_ns, const EgoState& ego);
  /// A complete list of objects. Braking, once begun, lasts until the ego stands or there was no conflict for
  /// a while, and is never weakened meanwhile.
  BrakeDecision object_list(std::int64_t time_ns, std::span<const ObjectReport> objects);

 private:
  Parameters parameters_;
  EgoState ego_;
  std::optional<std::int64_t> ego_time_ns_;
  double latched_mps2_ = 0.0;
  std::int64_t last_conflict_ns_ = 0;
};

}  // namespace hil::crossing::aeb
