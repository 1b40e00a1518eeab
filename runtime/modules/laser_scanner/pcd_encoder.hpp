#pragma once
// Point clouds as files pointclouds/<module>-<number>.pcd of a run: PCD files, version 0.7, binary, the
// format of the Point Cloud Library, which its viewer, CloudCompare, Open3D and others read. Fields, in this
// order: x y z (m, sensor frame), intensity (1/m^2), fraction, column, row, return, entity, material, time (s
// of run time). VIEWPOINT is the pose of the sensor in the world at the begin of the sweep.
//
// Source: https://pointclouds.org/documentation/tutorials/pcd_file_format.html
// Threads: as hil/file_stream.hpp.

#include <cstddef>
#include <span>
#include <string>

#include <hil/file_stream.hpp>
#include <rtstdb/entity.hpp>

#include "runtime/modules/laser_scanner/cloud_point.hpp"

namespace hil::modules {

/// At the front of a buffer; the points follow.
struct CloudHead {
  std::uint64_t number = 0;  ///< of the cloud, from 1
  rtstdb::Pose sensor{};     ///< at the begin of the sweep
};

/// The points of a buffer that has a head.
inline std::span<CloudPoint> points_in(std::span<std::byte> buffer) noexcept {
  const std::span<std::byte> rest = buffer.subspan(sizeof(CloudHead));
  return {reinterpret_cast<CloudPoint*>(rest.data()), rest.size() / sizeof(CloudPoint)};
}

class PcdEncoder final : public FileEncoder {
 public:
  /// `name`: of the module.
  explicit PcdEncoder(std::string name) : name_(std::move(name)) {}
  void encode(std::span<std::byte> buffer, std::int64_t time_ns, FileOutput& files) override;

 private:
  const std::string name_;
};

}  // namespace hil::modules
