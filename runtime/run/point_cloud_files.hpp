#pragma once
// The point clouds of a run, as files pointclouds/<module>-<number>.pcd in its folder. The tick fills
// preallocated buffers; an ordinary thread writes them to files. If all buffers of a stream wait for the
// disk, the next cloud is lost and counted, and its number is left out. Under the virtual clock the tick
// waits for a buffer instead, so no cloud is lost.
//
// Threads: open and close at setup and after the last tick; the streams in the tick.

#include <atomic>
#include <filesystem>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "runtime/modules/point_cloud.hpp"

namespace hil::run {

/// The folder of the clouds in the folder of a run.
std::filesystem::path point_cloud_folder(const std::filesystem::path& run_folder);

class PointCloudFiles final : public modules::PointCloudSink {
 public:
  PointCloudFiles(const std::filesystem::path& run_folder, bool virtual_clock);
  ~PointCloudFiles() override;
  PointCloudFiles(const PointCloudFiles&) = delete;
  PointCloudFiles& operator=(const PointCloudFiles&) = delete;

  /// Throws io::DeviceError if the folder can not be created. A stream may outlive this object; clouds that
  /// it hands over later are lost.
  std::unique_ptr<modules::PointCloudStream> open(const std::string& name, std::size_t max_points) override;
  /// Writes the remaining clouds. Returns a sentence for each reason why clouds are missing.
  std::vector<std::string> close();

 private:
  class Buffers;
  class Stream;
  void serve();

  const std::filesystem::path folder_;
  const bool virtual_clock_;
  std::vector<std::shared_ptr<Buffers>> streams_;  // constant while the thread runs
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace hil::run
