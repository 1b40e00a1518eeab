#pragma once
// The port through which modules hand point clouds to the run, which writes them as files. Modules know no
// file format and no thread.
//
// Frame of a point: that of the sensor at the instant of the point's beam. Metres, seconds of run time.
// Threads: open at setup; begin and finish in the tick, where they do not allocate. In real time they do not
// block; under the virtual clock begin waits for the disk.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include <rtstdb/entity.hpp>

namespace hil::modules {

/// A detected return. Without padding, since files contain it as it lies in memory.
struct CloudPoint {
  float x_m = 0.0f, y_m = 0.0f, z_m = 0.0f;
  float intensity_per_m2 = 0.0f;
  float fraction = 0.0f;  ///< of the beam's cross-section
  std::uint32_t column = 0, row = 0;
  std::uint32_t ordinal = 0;  ///< of the return in its beam
  std::uint32_t entity = 0;   ///< its index
  std::uint32_t material = 0;
  double time_s = 0.0;  ///< of the beam
};
static_assert(sizeof(CloudPoint) == 48);

class PointCloudStream {
 public:
  virtual ~PointCloudStream() = default;
  /// Memory for the points of the next cloud, as many as `max_points` of open(). Empty: all buffers wait for
  /// the disk; the cloud is counted as lost.
  virtual std::span<CloudPoint> begin() noexcept = 0;
  /// Hands over the first `count` points. `sensor`: pose of the sensor at the begin of the sweep. Only after
  /// a begin() that was not empty.
  virtual void finish(std::size_t count, const rtstdb::Pose& sensor) noexcept = 0;
};

class PointCloudSink {
 public:
  virtual ~PointCloudSink() = default;
  /// A stream of clouds of at most `max_points` points. `name`: of the module, for the names of files. Clouds
  /// that a stream hands over after the end of the sink are lost.
  virtual std::unique_ptr<PointCloudStream> open(const std::string& name, std::size_t max_points) = 0;
};

}  // namespace hil::modules
