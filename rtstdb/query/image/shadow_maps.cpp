#include "rtstdb/query/image/shadow_maps.hpp"

#include <utility>

#include "rtstdb/query/keep.hpp"

namespace rtstdb::query {
namespace {

constexpr std::size_t reach_bytes = 2 * sizeof(std::uint32_t);

}  // namespace

Result<void> ShadowMaps::create(gpu::Device& device, const ImageQueryOptions& options) {
  using enum gpu::ShaderId;
  pixels_ = options.width * options.height;
  side_ = options.shadow_map_side;
  const gpu::ShaderInfo& vertex = gpu::shader_info(image_raster_vertex);
  using enum gpu::BeyondDepth;
  if (auto kept = keep(device.create_raster_pipeline(vertex, nullptr, clipped), clipping_); !kept)
    return kept;
  if (auto kept = keep(device.create_raster_pipeline(vertex, nullptr, clamped), clamping_); !kept)
    return kept;
  if (auto kept = keep(device.create_pipeline(image_visible_from_light), visible_kernel_); !kept) return kept;
  if (auto kept = keep(device.create_pipeline(image_reach), reach_kernel_); !kept) return kept;
  if (auto kept =
          keep(device.create_raster_target(
                   {.name = options.name + " shadow map", .width = side_, .height = side_, .words = false}),
               target_);
      !kept)
    return kept;
  const std::size_t texels = std::size_t{side_} * side_ * options.shadow_maps * options.capacity;
  return device.create_buffers(std::vector<gpu::BufferRequest>{
      {&maps_, {.name = options.name + " shadow maps", .size_bytes = texels * sizeof(float)}},
      {&depths_, {.name = options.name + " depths", .size_bytes = pixels_ * sizeof(float)}},
      {&reach_, {.name = options.name + " reach", .size_bytes = options.capacity * reach_bytes}},
      {&no_paths_, {.name = options.name + " no paths", .size_bytes = sizeof(shared::PathRecord)}}});
}

Result<void> ShadowMaps::bind(gpu::Device& device, const gpu::Buffer& cameras, const gpu::Buffer& lights,
                              const ImageRaster& raster, const accel::GeometryPool& pool,
                              const accel::Tlas& tlas) {
  visible_bindings_.clear();
  reach_bindings_.clear();
  for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
    const std::vector<const gpu::Buffer*> of_visible{&cameras,
                                                     &no_paths_,
                                                     &tlas.instances(slot),
                                                     &tlas.places(slot),
                                                     &pool.geometries(),
                                                     &raster.visible(),
                                                     &raster.draws(),
                                                     &lights,
                                                     &reach_};
    auto visible = device.create_bindings(visible_kernel_, of_visible);
    if (!visible) return visible.error();
    visible_bindings_.push_back(std::move(visible).value());
    const std::vector<const gpu::Buffer*> of_reach{&cameras,           &no_paths_, &tlas.instances(slot),
                                                   &tlas.places(slot), &depths_,   &reach_};
    auto reach = device.create_bindings(reach_kernel_, of_reach);
    if (!reach) return reach.error();
    reach_bindings_.push_back(std::move(reach).value());
  }
  const std::vector<const gpu::Buffer*> buffers{&pool.triangles(), &raster.visible()};
  return keep(device.create_bindings(clipping_, buffers), raster_bindings_);
}

void ShadowMaps::record_warm_up(const ImageRaster& raster, gpu::Recorder& recorder) const noexcept {
  recorder.dispatch(visible_kernel_, visible_bindings_.front(), shared::ImageArgs{}, 1);
  recorder.dispatch(reach_kernel_, reach_bindings_.front(), shared::ImageArgs{}, 1);
  recorder.barrier();
  raster.record_one_triangle(recorder);
  for (const gpu::RasterPipeline* pipeline : {&clipping_, &clamping_}) {
    recorder.draw(*pipeline, raster_bindings_, {}, target_, raster.draws(), 1);
    recorder.copy_depth(target_, maps_, 0);
    recorder.barrier();
  }
}

void ShadowMaps::record_reach(const ImageRaster& raster, std::uint32_t image, const shared::ImageArgs& args,
                              const Recording& recording, std::uint32_t max_groups) const noexcept {
  gpu::Recorder& recorder = recording.recorder;
  recorder.copy_depth(raster.target(), depths_, 0);
  recorder.fill(reach_, image * reach_bytes, 4, 0);
  recorder.fill(reach_, image * reach_bytes + 4, 4, 0xFFFFFFFFu);
  recorder.barrier();
  dispatch_all(pixels_, image, args, max_groups, [&](const shared::ImageArgs& piece, std::uint32_t groups) {
    recorder.dispatch(reach_kernel_, reach_bindings_[recording.view.slot], piece, groups);
  });
  recorder.barrier();
}

void ShadowMaps::record(const ImageRaster& raster, const ImageLights& lights, std::uint32_t image,
                        std::uint32_t index, shared::ImageArgs args, const Recording& recording,
                        std::uint32_t max_groups) const noexcept {
  gpu::Recorder& recorder = recording.recorder;
  const std::uint32_t instances = recording.view.entities;
  const ImageLights::MapOfLight map = lights.map(index);
  args.light = map.light;
  args.face = map.face;
  dispatch_all(instances, image, args, max_groups, [&](const shared::ImageArgs& piece, std::uint32_t groups) {
    recorder.dispatch(visible_kernel_, visible_bindings_[recording.view.slot], piece, groups);
  });
  recorder.barrier();
  const bool parallel = map.light < lights.counts().suns_end;
  recorder.draw(parallel ? clamping_ : clipping_, raster_bindings_, {}, target_, raster.draws(), instances);
  const std::size_t place = std::size_t{image} * lights.counts().maps + index;
  recorder.copy_depth(target_, maps_, place * side_ * side_ * sizeof(float));
  recorder.barrier();  // the next map uses the same buffers
}

}  // namespace rtstdb::query
