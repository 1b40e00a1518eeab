#pragma once
// Shadow maps of the lights of a batch: for each image, what each light sees in the middle of its exposure. A
// texel holds the depth of the first surface (shaders/query/image/shadow_view.glsl). All maps are in one
// buffer, image by image.

#include <cstdint>
#include <string>
#include <vector>

#include "rtstdb/query/image/image_lights.hpp"
#include "rtstdb/query/image/image_raster.hpp"

namespace rtstdb::query {

class ShadowMaps {
 public:
  /// Creates maps and pipelines for the images of the query. Errors: capacity, out_of_memory, device_lost.
  Result<void> create(gpu::Device& device, const ImageQueryOptions& options);
  /// Again whenever the pool's generation has changed, after raster.bind. `cameras`: CameraRecords, `lights`:
  /// LightRecords.
  Result<void> bind(gpu::Device& device, const gpu::Buffer& cameras, const gpu::Buffer& lights,
                    const ImageRaster& raster, const accel::GeometryPool& pool, const accel::Tlas& tlas);
  void destroy() noexcept { *this = {}; }
  bool exists() const noexcept { return static_cast<bool>(target_); }
  void record_warm_up(const ImageRaster& raster, gpu::Recorder& recorder) const noexcept;

  /// Measures how far the surfaces are that `raster` has just drawn for an image.
  void record_reach(const ImageRaster& raster, std::uint32_t image, const shared::ImageArgs& args,
                    const Recording& recording, std::uint32_t max_groups) const noexcept;
  /// Draws map `index` of an image, after its record_reach.
  void record(const ImageRaster& raster, const ImageLights& lights, std::uint32_t image, std::uint32_t index,
              shared::ImageArgs args, const Recording& recording, std::uint32_t max_groups) const noexcept;

  /// Depths, the maps of an image one after the other, row by row: near_lamp_m over the distance along the
  /// view, or of parallel light from 1 to 0 across the square; 0: nothing.
  const gpu::Buffer& maps() const noexcept { return maps_; }
  /// Of each image: the largest and the least depth of its pixels, as words.
  const gpu::Buffer& reach() const noexcept { return reach_; }

 private:
  std::uint32_t pixels_ = 0;  // of an image
  std::uint32_t side_ = 0;
  gpu::RasterTarget target_;
  gpu::RasterPipeline clipping_, clamping_;
  gpu::Pipeline visible_kernel_, reach_kernel_;
  gpu::Buffer maps_, depths_, reach_, no_paths_;
  std::vector<gpu::Bindings> visible_bindings_, reach_bindings_;  // one per slot
  gpu::Bindings raster_bindings_;
};

}  // namespace rtstdb::query
