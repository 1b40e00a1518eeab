#include "runtime/run/point_cloud_files.hpp"

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <system_error>
#include <utility>

#include "io/device.hpp"
#include "runtime/run/pcd_file.hpp"
#include "runtime/run/write_ring.hpp"

namespace hil::run {

/// The buffers of one stream: the tick fills them in turn, and the writing thread writes them to files.
class PointCloudFiles::Buffers {
 public:
  Buffers(std::filesystem::path folder, std::string name, std::size_t max_points, bool waits)
      : folder_(std::move(folder)), name_(std::move(name)), ring_(waits) {
    for (Cloud& cloud : ring_.slots())
      cloud.points.resize(max_points);
  }

  // ---- the tick
  std::span<modules::CloudPoint> begin() noexcept {
    ++number_;
    cloud_ = ring_.begin();
    return cloud_ == nullptr ? std::span<modules::CloudPoint>() : cloud_->points;
  }
  void finish(std::size_t count, const rtstdb::Pose& sensor) noexcept {
    cloud_->count = count;
    cloud_->number = number_;
    cloud_->sensor = sensor;
    ring_.finish();
  }

  // ---- the writing thread; close
  void write_filled() {
    ring_.write_filled([this](const Cloud& cloud) { write(cloud); });
  }
  /// After the last tick.
  void close(std::vector<std::string>& faults) {
    ring_.close();
    write_filled();
    const auto clouds = [](std::uint64_t count) {
      return std::to_string(count) + (count == 1 ? " point cloud" : " point clouds");
    };
    if (const std::uint64_t lost = ring_.lost(); lost > 0)
      faults.push_back(clouds(lost) + " of " + name_ + " are not in files: the disk was too slow");
    if (failed_ > 0)
      faults.push_back(clouds(failed_) + " of " + name_ +
                       " could not be written; the first: " + first_fault_);
  }

 private:
  struct Cloud {
    std::vector<modules::CloudPoint> points{};
    std::size_t count = 0;
    std::uint64_t number = 0;
    rtstdb::Pose sensor{};
  };

  void write(const Cloud& cloud) {
    char file[64];
    std::snprintf(file, sizeof file, "-%06llu.pcd", static_cast<unsigned long long>(cloud.number));
    const std::string fault =
        write_pcd(folder_ / (name_ + file), std::span(cloud.points).first(cloud.count), cloud.sensor);
    if (!fault.empty() && failed_++ == 0) first_fault_ = fault;
  }

  const std::filesystem::path folder_;
  const std::string name_;
  WriteRing<Cloud> ring_;
  Cloud* cloud_ = nullptr;    // that the tick fills
  std::uint64_t number_ = 0;  // of the cloud that was begun last, from 1
  std::uint64_t failed_ = 0;
  std::string first_fault_;
};

class PointCloudFiles::Stream final : public modules::PointCloudStream {
 public:
  explicit Stream(std::shared_ptr<Buffers> buffers) : buffers_(std::move(buffers)) {}
  std::span<modules::CloudPoint> begin() noexcept override { return buffers_->begin(); }
  void finish(std::size_t count, const rtstdb::Pose& sensor) noexcept override {
    buffers_->finish(count, sensor);
  }

 private:
  std::shared_ptr<Buffers> buffers_;
};

std::filesystem::path point_cloud_folder(const std::filesystem::path& run_folder) {
  return run_folder / "pointclouds";
}

PointCloudFiles::PointCloudFiles(const std::filesystem::path& run_folder, bool virtual_clock)
    : folder_(point_cloud_folder(run_folder)), virtual_clock_(virtual_clock) {}

PointCloudFiles::~PointCloudFiles() {
  close();
}

std::unique_ptr<modules::PointCloudStream> PointCloudFiles::open(const std::string& name,
                                                                 std::size_t max_points) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw io::DeviceError("folder " + folder_.string() + " can not be created: " + error.message());
  // The thread reads the list without a lock, so it is stopped while the list changes.
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  streams_.push_back(std::make_shared<Buffers>(folder_, name, max_points, virtual_clock_));
  stopping_.store(false, std::memory_order_release);
  thread_ = std::thread([this] { serve(); });
  return std::make_unique<Stream>(streams_.back());
}

void PointCloudFiles::serve() {
  while (!stopping_.load(std::memory_order_acquire)) {
    for (const std::shared_ptr<Buffers>& stream : streams_)
      stream->write_filled();
    std::this_thread::sleep_for(std::chrono::milliseconds(virtual_clock_ ? 1 : 5));
  }
}

std::vector<std::string> PointCloudFiles::close() {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  std::vector<std::string> faults;
  for (const std::shared_ptr<Buffers>& stream : streams_)
    stream->close(faults);
  streams_.clear();
  return faults;
}

}  // namespace hil::run
