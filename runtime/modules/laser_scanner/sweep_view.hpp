#pragma once
// A sample of the detected returns of the last sweep: the points of the map, and the pictures of the report.
//
// Threads: begin_sweep and add in the tick, without allocation; all else after the run.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include <hil/contribution.hpp>
#include <rtstdb/entity.hpp>

#include "runtime/modules/laser_scanner/scan_pattern.hpp"

namespace hil::modules {

class SweepView {
 public:
  static constexpr std::size_t max_points = 4000;

  /// `beams`: in a sweep. If they are more than max_points, every n-th one is kept.
  explicit SweepView(std::uint64_t beams);

  struct Point {
    contribution::SensorPoint world;   ///< as on the map
    contribution::SensorPoint sensor;  ///< in the sensor frame
    rtstdb::EntityId entity;
    double intensity_per_m2 = 0.0;
  };
  void begin_sweep() noexcept;
  bool wants(std::uint64_t beam) const noexcept {
    return beam % every_ == 0 && points_.size() < points_.capacity();
  }
  /// Adds a return of a beam for which wants() is true.
  void add(const Point& point) noexcept { points_.push_back(point); }

  /// The points of the last complete sweep; in the first sweep, those so far.
  std::vector<contribution::SensorPoint> map_points() const;
  /// Adds pictures of the sweep from the scanner's place, coloured by body and by intensity; none if there is
  /// no point.
  void contribute(const std::string& scanner, const std::function<std::string(rtstdb::EntityId)>& name_of,
                  contribution::Contribution& report) const;

 private:
  const std::vector<Point>& shown() const noexcept { return last_.empty() ? points_ : last_; }

  std::uint64_t every_ = 1;
  std::vector<Point> points_, last_;
};

}  // namespace hil::modules
