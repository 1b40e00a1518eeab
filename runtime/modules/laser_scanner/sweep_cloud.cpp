#include "runtime/modules/laser_scanner/sweep_cloud.hpp"

#include <utility>

namespace hil::modules {

void SweepCloud::open(std::unique_ptr<PointCloudStream> stream, std::uint32_t sweeps) noexcept {
  stream_ = std::move(stream);
  sweeps_ = sweeps;
}

void SweepCloud::begin_sweep(std::int64_t sweep, const rtstdb::Pose& sensor) noexcept {
  end_sweep();
  if (!stream_ || sweep % sweeps_ != 0) return;
  points_ = stream_->begin();
  count_ = 0;
  sensor_ = sensor;
}

void SweepCloud::add(const CloudPoint& point) noexcept {
  if (count_ < points_.size()) points_[count_++] = point;
}

void SweepCloud::end_sweep() noexcept {
  if (!points_.empty()) stream_->finish(count_, sensor_);
  points_ = {};
}

}  // namespace hil::modules
