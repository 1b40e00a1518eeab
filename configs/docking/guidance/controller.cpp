#include "configs/docking/guidance/controller.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>

namespace hil::docking::guidance {

namespace {

// The capsule's x points into the port: a rotation of -90 degrees about z.
const glm::dquat docking_attitude(std::sqrt(0.5), 0.0, 0.0, -std::sqrt(0.5));

// Lateral and attitude control: damped oscillators of these angular frequencies.
constexpr double lateral_radps = 0.18;
constexpr double lateral_damping = 0.9;
constexpr double attitude_radps = 0.3;
constexpr double attitude_damping = 0.9;
constexpr double speed_gain_1ps = 0.4;
constexpr double stop_gain_1ps = 0.3;
constexpr double max_lateral_mps2 = 0.05;
constexpr double first_sigma_mps = 0.3;
/// A fix farther than this many standard deviations from the track is not used.
constexpr double gate_sigmas = 4.0;

double seconds(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

glm::dvec3 limited(const glm::dvec3& v, double largest) {
  return glm::clamp(v, glm::dvec3(-largest), glm::dvec3(largest));
}

}  // namespace

void Controller::attitude(std::int64_t time_ns, const Attitude& attitude) {
  attitude_ = attitude;
  attitude_.q = glm::normalize(attitude_.q);
  attitude_time_ns_ = time_ns;
}

/// The beam turns from left to right: a detection is the older, the farther left it is.
double Controller::age_s(std::span<const Detection> detections) const {
  double azimuth_rad = 0.0;
  for (const Detection& detection : detections)
    azimuth_rad += detection.azimuth_rad / static_cast<double>(detections.size());
  const double left = std::clamp(0.5 + azimuth_rad / parameters_.horizontal_rad, 0.0, 1.0);
  return left * parameters_.scan_period_s + parameters_.delay_s;
}

void Controller::take_scan(std::int64_t time_ns, std::span<const Detection> detections) {
  if (detections.empty()) return;
  const double age = age_s(detections);
  if (!fix_time_ns_) {
    const auto fix = find_position(detections, attitude_.q, parameters_.scanner);
    if (!fix || fix->reflectors < parameters_.min_reflectors) return;
    track_.begin(fix->p_station_m, fix->sigma_m, first_sigma_mps);
  } else {
    const glm::dvec3 expected = track_.p_m() - age * track_.v_mps();
    const double beam_m = std::abs(track_.p_m().y) * std::sin(parameters_.scanner.beam_half_angle_rad) + 0.1;
    const double gate_m = gate_sigmas * std::hypot(track_.sigma_m(), beam_m);
    const auto fix = find_position(detections, attitude_.q, parameters_.scanner, expected, gate_m);
    if (!fix) return;
    track_.update(fix->p_station_m, fix->sigma_m, age);
  }
  fix_time_ns_ = time_ns;
  ++fixes_;
}

Mode Controller::next_mode(std::int64_t time_ns, bool docked) const {
  if (docked) return Mode::docked;
  if (!attitude_time_ns_ || time_ns - *attitude_time_ns_ > parameters_.attitude_timeout_ns)
    return Mode::blind;
  if (!fix_time_ns_) return Mode::search;
  const bool is_near = track_.p_m().y < parameters_.last_distance_m;
  const std::int64_t limit_ns = is_near ? parameters_.last_limit_ns : parameters_.lost_after_ns;
  if (time_ns - *fix_time_ns_ > limit_ns) return Mode::wait;
  return is_near ? Mode::last : Mode::approach;
}

glm::dvec3 Controller::wanted_acceleration(Mode mode) const {
  const glm::dvec3 p = track_.p_m(), v = track_.v_mps();
  if (mode == Mode::wait) return limited(-stop_gain_1ps * v, max_lateral_mps2);
  if (mode != Mode::approach && mode != Mode::last) return glm::dvec3(0.0);
  const double stiffness = lateral_radps * lateral_radps;
  const double damping = 2.0 * lateral_damping * lateral_radps;
  glm::dvec3 wanted = limited(-stiffness * p - damping * v, max_lateral_mps2);
  // Along the axis, y, the speed is given by the distance; it falls to 0 at the edge of the corridor.
  const double distance_m = std::max(p.y, 0.0);
  const double lateral_m = std::hypot(p.x, p.z);
  const double corridor_m = parameters_.corridor_m + parameters_.corridor_per_distance * distance_m;
  const double share = std::clamp(2.0 - 2.0 * lateral_m / corridor_m, 0.0, 1.0);
  const double profile_mps = parameters_.docking_speed_mps + parameters_.speed_per_distance_1ps * distance_m;
  const double speed_mps = share * std::min(profile_mps, parameters_.max_speed_mps);
  const bool slows_down = profile_mps < parameters_.max_speed_mps && distance_m > 0.0;
  const double feed_forward = slows_down ? share * parameters_.speed_per_distance_1ps * -v.y : 0.0;
  wanted.y = -(speed_gain_1ps * (speed_mps - -v.y) - feed_forward);
  return wanted;
}

glm::dvec3 Controller::wanted_torque() const {
  glm::dquat error = glm::conjugate(docking_attitude) * attitude_.q;
  if (error.w < 0.0) error = -error;
  const glm::dvec3 angle_rad = 2.0 * glm::dvec3(error.x, error.y, error.z);
  const glm::dvec3 wanted_radps2 = -attitude_radps * attitude_radps * angle_rad -
                                   2.0 * attitude_damping * attitude_radps * attitude_.w_body_radps;
  return limited(parameters_.inertia_kgm2 * wanted_radps2, parameters_.max_torque_nm);
}

Command Controller::detections(std::int64_t time_ns, const DetectionList& list) {
  if (fix_time_ns_ && list_time_ns_) track_.predict(seconds(*list_time_ns_, time_ns), commanded_mps2_);
  list_time_ns_ = time_ns;
  const bool is_new = scan_ != list.scan;
  scan_ = list.scan;
  if (is_new && attitude_time_ns_) take_scan(time_ns, list.detections);
  Command command{.mode = next_mode(time_ns, list.docked)};
  if (fix_time_ns_) command.distance_m = track_.p_m().y;
  commanded_mps2_ = glm::dvec3(0.0);
  if (command.mode == Mode::docked || command.mode == Mode::blind) return command;
  command.torque_body_nm = wanted_torque();
  const glm::dvec3 force = parameters_.mass_kg * wanted_acceleration(command.mode);
  command.force_body_n = limited(glm::conjugate(attitude_.q) * force, parameters_.max_force_n);
  commanded_mps2_ = attitude_.q * command.force_body_n / parameters_.mass_kg;
  return command;
}

}  // namespace hil::docking::guidance
