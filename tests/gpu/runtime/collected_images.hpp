#pragma once
// Keeps the images of cameras in memory.

#include <memory>
#include <vector>

#include "runtime/modules/camera_images.hpp"

namespace hil::modules::test {

struct CollectedImage {
  std::int64_t time_ns = 0;
  std::vector<rtstdb::HalfColor> color{};
  std::vector<rtstdb::SrgbColor> srgb{};
  std::vector<float> depth_m{};
};

/// Has room for a number of images; further ones are dropped.
class CollectedImages final : public CameraImageSink {
 public:
  static constexpr std::size_t capacity = 32;

  std::unique_ptr<CameraImageStream> open(const CameraStreamOptions& given) override {
    options = given;
    images.resize(capacity);
    const std::size_t pixels = std::size_t{given.width} * given.height;
    const bool has_noise = given.sensor.full_well_e > 0.0;
    for (CollectedImage& image : images) {
      image.color.resize(given.has_images && has_noise ? pixels : 0);
      image.srgb.resize(given.has_images && !has_noise ? pixels : 0);
      image.depth_m.resize(given.depth_step_m > 0.0 ? pixels : 0);
    }
    return std::make_unique<Stream>(*this);
  }

  CameraStreamOptions options{};
  std::vector<CollectedImage> images{};
  std::size_t count = 0;  ///< of images that are in use

 private:
  class Stream final : public CameraImageStream {
   public:
    explicit Stream(CollectedImages& all) : all_(all) {}
    std::optional<CameraFrame> begin() noexcept override {
      if (all_.count == capacity) return std::nullopt;
      CollectedImage& image = all_.images[all_.count];
      return CameraFrame{.color = image.color, .srgb = image.srgb, .depth_m = image.depth_m};
    }
    void finish(std::int64_t time_ns) noexcept override { all_.images[all_.count++].time_ns = time_ns; }

   private:
    CollectedImages& all_;
  };
};

}  // namespace hil::modules::test
