#pragma once
// The comparison of the paper's Figure 8: one body as a sweep sees it that takes motion into account, and as
// one that shoots every beam at the sweep's first instant, beside its true length and the closed form
// (apparent_length.hpp). For each body the first sweep is kept that has its whole side in view. A sweep with
// more than 32768 points of one body is not judged for it.
//
// Threads: begin_sweep, add_hit, end_sweep in the scanner's step, without allocation; pictures after the run.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <rtstdb/query.hpp>

#include "runtime/contribution/map.hpp"
#include "runtime/modules/laser_scanner/apparent_length.hpp"

namespace hil::modules {

/// A body whose side is measured: a box of this length and width, turned with its direction of travel.
struct ComparedBody {
  std::string name;
  rtstdb::EntityId entity;
  double length_m = 0.0;
  double width_m = 0.0;
};

/// What is known of a body at a sweep's begin.
struct BodyMotion {
  MovingPoint center;
  double heading_rad = 0.0;
};

class SweepComparison {
 public:
  /// Of one body in one sweep.
  static constexpr std::size_t max_points = std::size_t{1} << 15;

  struct Measured {
    double length_m = 0.0;
    std::uint32_t first_column = 0, last_column = 0;
  };
  struct Finding {
    bool complete = false;  ///< a sweep saw the body's whole side; else the rest means nothing
    bool too_many = false;  ///< a sweep had more points of the body than are kept
    std::int64_t begin_ns = 0;
    Measured moving, still;
    double closed_form_m = 0.0;
    double tolerance_m = 0.0;  ///< 1 % and one beam pitch
    std::vector<contribution::SensorPoint> moving_points, still_points;
  };

  SweepComparison(const ScanPattern& pattern, std::vector<ComparedBody> bodies);

  /// How sensor and bodies (in the order of construction) move at the sweep's begin; a body may be gone.
  void begin_sweep(std::int64_t begin_ns, const SensorMotion& sensor,
                   std::span<const std::optional<BodyMotion>> bodies) noexcept;
  /// A hit of beam (column, row); `still`: of the sweep without motion.
  void add_hit(const rtstdb::RayHit& hit, std::uint32_t column, std::uint32_t row, bool still) noexcept;
  void end_sweep() noexcept;

  const std::vector<ComparedBody>& bodies() const noexcept { return bodies_; }
  const Finding& finding(std::size_t body) const noexcept { return findings_[body]; }

 private:
  struct Seen {
    contribution::SensorPoint point;
    std::uint32_t column = 0;
    bool side = false;  ///< of the body: an upright face turned away from its direction of travel
  };
  struct Collected {
    std::optional<BodyMotion> motion;
    std::vector<Seen> moving, still;
    bool too_many = false;
  };
  std::optional<Measured> measure(const std::vector<Seen>& seen, double heading_rad) const noexcept;
  /// Of one column, laid on a line through the point (sensor frame) in the unit direction `along`.
  double column_width_m(const glm::dvec2& p_sensor_m, const glm::dvec2& along) const noexcept;
  void judge(std::size_t body) noexcept;

  const ScanPattern pattern_;
  const std::vector<ComparedBody> bodies_;
  std::int64_t begin_ns_ = 0;
  SensorMotion sensor_;
  std::vector<Collected> collected_;  // by body
  std::vector<Finding> findings_;     // by body
};

}  // namespace hil::modules
