#pragma once
// Fills the point clouds of a scanner: one of every so many sweeps.
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
  /// From now on the sweeps `sweeps` * n have a cloud.
  void open(std::unique_ptr<PointCloudStream> stream, std::uint32_t sweeps) noexcept;
  /// A sweep begins, counted from 0. Hands over the cloud of the sweep before, if its end was skipped.
  /// `sensor`: its pose now.
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
