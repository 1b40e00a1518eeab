#pragma once
// First hits with the rasteriser: for each image a kernel lists the instances that the camera may see, the
// rasteriser draws them, and its words go to a buffer (shaders/query/image/image_visible.comp, image_raster).

#include <cstdint>
#include <string>
#include <vector>

#include "rtstdb/gpu/raster.hpp"
#include "rtstdb/query/gpu_query.hpp"
#include "shaders/shared/image.h"

namespace rtstdb::query {

/// Dispatches a kernel of images for all places from 0 to before `end`. `dispatch`: as for in_pieces.
template <class Dispatch>
void dispatch_all(std::uint32_t end, std::uint32_t image, shared::ImageArgs args, std::uint32_t max_groups,
                  const Dispatch& dispatch) noexcept {
  args.first = 0;
  args.end = end;
  args.per_group = places_per_group;
  args.halt = glm::uvec2(0);
  args.image = image;
  in_pieces({places_per_group, (end + places_per_group - 1) / places_per_group}, max_groups, args, dispatch);
}

class ImageRaster {
 public:
  /// Creates targets and pipelines for `images` images. Errors: capacity, out_of_memory, device_lost.
  Result<void> create(gpu::Device& device, const std::string& name, std::uint32_t width, std::uint32_t height,
                      std::uint32_t images);
  /// Again whenever the pool's generation has changed. `cameras`: CameraRecords.
  Result<void> bind(gpu::Device& device, const gpu::Buffer& cameras, const accel::GeometryPool& pool,
                    const accel::Tlas& tlas);
  void destroy() noexcept { *this = {}; }
  bool exists() const noexcept { return static_cast<bool>(target_); }
  void record_warm_up(gpu::Recorder& recorder) const noexcept;
  /// Sets up a draw of one triangle without extent.
  void record_one_triangle(gpu::Recorder& recorder) const noexcept;

  /// Draws an image. `args`: the epoch of the view; the other members do not matter. `max_groups`: of a
  /// dispatch.
  void record(std::uint32_t image, const shared::ImageArgs& args, const Recording& recording,
              std::uint32_t max_groups) const noexcept;

  /// Two words for each pixel of all images: instance and triangle in the pool, or all bits set.
  const gpu::Buffer& drawn() const noexcept { return drawn_; }
  /// Words and depths of the last image.
  const gpu::RasterTarget& target() const noexcept { return target_; }
  /// For other draws: what the vertex shader reads, and the commands, by place of an instance.
  const gpu::Buffer& visible() const noexcept { return visible_; }
  const gpu::Buffer& draws() const noexcept { return draws_; }

 private:
  std::string name_;
  std::uint32_t pixels_ = 0;  // of an image
  gpu::RasterTarget target_;
  gpu::RasterPipeline pipeline_;
  gpu::Pipeline visible_kernel_;
  gpu::Buffer drawn_, paths_;
  gpu::Buffer visible_, draws_;                  // by place of an instance
  std::vector<gpu::Bindings> visible_bindings_;  // one per slot
  gpu::Bindings raster_bindings_;
};

}  // namespace rtstdb::query
