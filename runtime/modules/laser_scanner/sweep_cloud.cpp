#include "runtime/modules/laser_scanner/sweep_cloud.hpp"

#include <cstring>

namespace hil::modules {

void SweepCloud::open(FileStreams& files, const std::string& name, std::uint64_t max_points,
                      std::uint32_t sweeps) {
  stream_ = files.open({.folder = "pointclouds",
                        .owner = name,
                        .singular = "point cloud",
                        .plural = "point clouds",
                        .buffer_bytes = sizeof(CloudHead) + max_points * sizeof(CloudPoint),
                        .encoder = std::make_shared<PcdEncoder>(name)});
  sweeps_ = sweeps;
}

void SweepCloud::begin_sweep(std::int64_t sweep, const rtstdb::Pose& sensor, std::int64_t time_ns) noexcept {
  end_sweep();
  if (!stream_ || sweep % sweeps_ != 0) return;
  ++number_;
  buffer_ = stream_->begin();
  count_ = 0;
  time_ns_ = time_ns;
  const CloudHead head{number_, sensor};
  if (!buffer_.empty()) std::memcpy(buffer_.data(), &head, sizeof head);
}

void SweepCloud::add(const CloudPoint& point) noexcept {
  if (buffer_.empty()) return;
  const std::span<CloudPoint> points = points_in(buffer_);
  if (count_ < points.size()) points[count_++] = point;
}

void SweepCloud::end_sweep() noexcept {
  if (!buffer_.empty()) stream_->finish(sizeof(CloudHead) + count_ * sizeof(CloudPoint), time_ns_);
  buffer_ = {};
}

}  // namespace hil::modules
