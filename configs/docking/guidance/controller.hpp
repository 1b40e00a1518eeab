#pragma once
// The guidance of the capsule: it computes the force and torque of the thrusters from the reflectors that the
// scanner detects, the attitude and the rates. It uses no bus and no clock: results depend only on the calls
// and their times.
//
//   search    no position is known: the capsule turns its port to the station and waits
//   approach  the capsule moves along the axis of the port, the slower the closer; while it is too far from
//             the axis, it keeps its distance
//   last      the last metres, in which reflectors leave the field of view: the estimate is used for longer
//             without detections
//   wait      no detections have fitted the pattern for too long: the capsule stops
//   docked    the port has captured the capsule: no thrust
//   blind     there is no fresh attitude: no thrust
//
// Frames and units as in position_fix.hpp. Times are nanoseconds of one monotonic clock. Threads: one.

#include <cstdint>
#include <optional>
#include <span>

#include "configs/docking/guidance/position_fix.hpp"
#include "configs/docking/guidance/track.hpp"

namespace hil::docking::guidance {

enum class Mode : std::uint8_t { search, approach, last, wait, docked, blind };

struct Attitude {
  glm::dquat q{1.0, 0.0, 0.0, 0.0};  ///< body frame to station frame
  glm::dvec3 w_body_radps{0.0};
};

/// A complete list of detections. `scan`: the number of the sweep that they are from.
struct DetectionList {
  std::uint32_t scan = 0;
  std::span<const Detection> detections{};
  bool docked = false;
};

struct Command {
  Mode mode = Mode::search;
  glm::dvec3 force_body_n{0.0};
  glm::dvec3 torque_body_nm{0.0};
  double distance_m = 0.0;  ///< estimated, along the port's axis; 0 while it is not known
};

struct Parameters {
  double mass_kg = 12'000.0;
  glm::dvec3 inertia_kgm2{20'000.0, 30'000.0, 30'000.0};
  double max_force_n = 800.0;    ///< for each axis of the body
  double max_torque_nm = 400.0;  ///< for each axis of the body

  double horizontal_rad = 0.6981317;  ///< field of view; a sweep goes from left to right
  double scan_period_s = 0.5;
  Scanner scanner{.mount_body_m = {-1.2, 0.0, 0.0}, .beam_half_angle_rad = 0.0078};
  double delay_s = 0.06;  ///< from the end of a sweep to its list of detections on the bus

  double docking_speed_mps = 0.07;
  double max_speed_mps = 0.8;
  double speed_per_distance_1ps = 0.05;  ///< the speed grows by this for each metre to the port
  double corridor_m = 0.10;              ///< permitted distance from the axis, at the port
  double corridor_per_distance = 0.10;   ///< the corridor grows by this for each metre to the port
  double last_distance_m = 2.5;          ///< where reflectors may leave the field of view

  std::size_t min_reflectors = 3;  ///< of the first fix; a later one has to be near the track instead
  std::int64_t lost_after_ns = 6'000'000'000;   ///< without a fix, beyond last_distance_m
  std::int64_t last_limit_ns = 60'000'000'000;  ///< without a fix, within it
  std::int64_t attitude_timeout_ns = 200'000'000;
};

class Controller {
 public:
  explicit Controller(Parameters parameters = {}) : parameters_(parameters) {}

  void attitude(std::int64_t time_ns, const Attitude& attitude);
  Command detections(std::int64_t time_ns, const DetectionList& list);

  const Track& track() const noexcept { return track_; }
  std::uint64_t fixes() const noexcept { return fixes_; }

 private:
  void take_scan(std::int64_t time_ns, std::span<const Detection> detections);
  double age_s(std::span<const Detection> detections) const;
  Mode next_mode(std::int64_t time_ns, bool docked) const;
  glm::dvec3 wanted_acceleration(Mode mode) const;
  glm::dvec3 wanted_torque() const;

  Parameters parameters_;
  Attitude attitude_;
  std::optional<std::int64_t> attitude_time_ns_, list_time_ns_, fix_time_ns_;
  std::optional<std::uint32_t> scan_;
  glm::dvec3 commanded_mps2_{0.0};  ///< since list_time_ns_, in the station frame
  Track track_;
  std::uint64_t fixes_ = 0;
};

}  // namespace hil::docking::guidance
