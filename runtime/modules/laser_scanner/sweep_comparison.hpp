#pragma once
// The measurements for the paper's Figure 8: the length of a body in a sweep with motion, where every beam
// has its own time, and in one without, where all beams have the time of the sweep's begin; beside them the
// true length and the closed form (apparent_length.hpp). Of each body the first sweep is kept in which the
// whole side was measured. A sweep with more than max_points points of a body is not used for it.
//
// Threads: begin_sweep, add_hit, end_sweep in the scanner's step, without allocation; findings after the run.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <hil/map.hpp>
#include <rtstdb/query.hpp>

#include "runtime/modules/laser_scanner/apparent_length.hpp"

namespace hil::modules {

/// A body whose side is measured: a box of this length and width along its direction of travel.
struct ComparedBody {
  std::string name;
  rtstdb::EntityId entity;
  double length_m = 0.0;
  double width_m = 0.0;
};

/// The motion of a body at the start of a sweep.
struct ComparedMotion {
  MovingPoint center;
  double heading_rad = 0.0;
};

class SweepComparison {
 public:
  /// Points of one body in one sweep.
  static constexpr std::size_t max_points = std::size_t{1} << 15;

  struct Measured {
    double length_m = 0.0;
    std::uint32_t first_column = 0, last_column = 0;
  };
  struct Finding {
    bool complete = false;  ///< a sweep measured the whole side; else the other members have no meaning
    bool too_many = false;  ///< a sweep had more than max_points points of the body
    std::int64_t begin_ns = 0;
    Measured moving, still;
    double closed_form_m = 0.0;
    double tolerance_m = 0.0;  ///< 1 % of the closed form, and the distance of two columns
    std::vector<contribution::SensorPoint> moving_points, still_points;
  };

  SweepComparison(const ScanPattern& pattern, std::vector<ComparedBody> bodies);

  /// The motions of the sensor and of the bodies, in the order of construction, at the start of the sweep;
  /// empty for a body that is deleted.
  void begin_sweep(std::int64_t begin_ns, const SensorMotion& sensor,
                   std::span<const std::optional<ComparedMotion>> bodies) noexcept;
  /// A hit of beam (column, row); `still`: in the sweep without motion.
  void add_hit(const rtstdb::RayHit& hit, std::uint32_t column, std::uint32_t row, bool still) noexcept;
  void end_sweep() noexcept;

  const std::vector<ComparedBody>& bodies() const noexcept { return bodies_; }
  const Finding& finding(std::size_t body) const noexcept { return findings_[body]; }

 private:
  struct Point {
    contribution::SensorPoint point;
    std::uint32_t column = 0;
    bool side = false;  ///< on the side of the body: an upright face along its direction of travel
  };
  struct Measurements {
    std::optional<ComparedMotion> motion;
    std::vector<Point> moving, still;
    bool too_many = false;
  };
  std::optional<Measured> measure(const std::vector<Point>& points, double heading_rad) const noexcept;
  /// The width of one column on a line through the point (sensor frame) in the unit direction `along`.
  double column_width_m(const glm::dvec2& p_sensor_m, const glm::dvec2& along) const noexcept;
  void evaluate(std::size_t body) noexcept;

  const ScanPattern pattern_;
  const std::vector<ComparedBody> bodies_;
  std::int64_t begin_ns_ = 0;
  SensorMotion sensor_;
  std::vector<Measurements> measurements_;  // by body
  std::vector<Finding> findings_;           // by body
};

}  // namespace hil::modules
