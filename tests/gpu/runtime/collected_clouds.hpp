#pragma once
// Keeps the point clouds of modules in memory.

#include <memory>
#include <string>
#include <vector>

#include "runtime/modules/point_cloud.hpp"

namespace hil::modules::test {

struct CollectedCloud {
  std::vector<CloudPoint> points;
  rtstdb::Pose sensor;
};

class CollectedClouds final : public PointCloudSink {
 public:
  std::unique_ptr<PointCloudStream> open(const std::string& /*name*/, std::size_t max_points) override {
    return std::make_unique<Stream>(*this, max_points);
  }
  std::vector<CollectedCloud> clouds;

 private:
  class Stream final : public PointCloudStream {
   public:
    Stream(CollectedClouds& all, std::size_t max_points) : all_(all), memory_(max_points) {}
    std::span<CloudPoint> begin() noexcept override { return memory_; }
    void finish(std::size_t count, const rtstdb::Pose& sensor) noexcept override {
      all_.clouds.push_back(
          {{memory_.begin(), memory_.begin() + static_cast<std::ptrdiff_t>(count)}, sensor});
    }

   private:
    CollectedClouds& all_;
    std::vector<CloudPoint> memory_;
  };
};

}  // namespace hil::modules::test
