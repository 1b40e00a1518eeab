#pragma once
// Fills the point clouds of a scanner: of every n-th sweep.
//
// Threads: open at setup; all else in the tick, without allocation.

#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "runtime/modules/laser_scanner/pcd_encoder.hpp"

namespace hil::modules {

class SweepCloud {
 public:
  /// From now on every sweep whose number is a multiple of `sweeps` has a cloud of at most `max_points`.
  /// `name`: of the module. Throws SetupError.
  void open(FileStreams& files, const std::string& name, std::uint64_t max_points, std::uint32_t sweeps);
  /// Begins sweep number `sweep`, counted from 0. Hands over the cloud of the previous sweep if end_sweep()
  /// was not called. `sensor`: the pose of the sensor at the begin of the sweep.
  void begin_sweep(std::int64_t sweep, const rtstdb::Pose& sensor, std::int64_t time_ns) noexcept;
  /// Adds a point if the sweep has a cloud.
  void add(const CloudPoint& point) noexcept;
  void end_sweep() noexcept;

 private:
  std::unique_ptr<FileStream> stream_;
  std::uint32_t sweeps_ = 1;
  std::span<std::byte> buffer_;  // of the stream; empty: this sweep has no cloud
  std::size_t count_ = 0;
  std::uint64_t number_ = 0;  // of the cloud that was begun last; those that were dropped count
  std::int64_t time_ns_ = 0;
};

}  // namespace hil::modules
