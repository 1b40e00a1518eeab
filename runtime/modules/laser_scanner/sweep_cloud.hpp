#pragma once
// Fills the point clouds of a scanner: of every n-th sweep.
//
// Threads: open at setup; all else in the tick, without allocation.

#include <cstdint>
#include <memory>
#include <span>

#include <rtstdb/entity.hpp>

#include "runtime/modules/point_cloud.hpp"

namespace hil::modules {

class SweepCloud {
 public:
  /// From now on every sweep whose number is a multiple of `sweeps` has a cloud.
  void open(std::unique_ptr<PointCloudStream> stream, std::uint32_t sweeps) noexcept;
  /// Begins sweep number `sweep`, counted from 0. Hands over the cloud of the previous sweep if end_sweep()
  /// was not called. `sensor`: the pose of the sensor at the begin of the sweep.
  void begin_sweep(std::int64_t sweep, const rtstdb::Pose& sensor) noexcept;
  /// Adds a point if the sweep has a cloud.
  void add(const CloudPoint& point) noexcept;
  void end_sweep() noexcept;

 private:
  std::unique_ptr<PointCloudStream> stream_;
  std::uint32_t sweeps_ = 1;
  std::span<CloudPoint> points_;  // memory of the stream; empty: this sweep has no cloud
  std::size_t count_ = 0;
  rtstdb::Pose sensor_;
};

}  // namespace hil::modules
