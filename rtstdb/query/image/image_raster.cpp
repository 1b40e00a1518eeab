#include "rtstdb/query/image/image_raster.hpp"

#include <utility>

#include "rtstdb/query/keep.hpp"
#include "shaders/shared/entity.h"

namespace rtstdb::query {
namespace {

constexpr std::size_t word_pair_bytes = 8;

/// Each entity has an instance for each of two epochs.
std::size_t entities_of(const gpu::Buffer& instances) noexcept {
  return instances.size_bytes() / (2 * shared::instance_texels * sizeof(glm::vec4));
}

}  // namespace

Result<void> ImageRaster::create(gpu::Device& device, const std::string& name, std::uint32_t width,
                                 std::uint32_t height, std::uint32_t images) {
  name_ = name;
  pixels_ = width * height;
  const gpu::ShaderInfo& vertex = gpu::shader_info(gpu::ShaderId::image_raster_vertex);
  const gpu::ShaderInfo& fragment = gpu::shader_info(gpu::ShaderId::image_raster_fragment);
  if (auto made =
          keep(device.create_raster_pipeline(vertex, &fragment, gpu::BeyondDepth::clipped), pipeline_);
      !made)
    return made;
  if (auto made = keep(device.create_pipeline(gpu::ShaderId::image_visible), visible_kernel_); !made)
    return made;
  if (auto made = keep(device.create_raster_target(
                           {.name = name + " raster", .width = width, .height = height, .words = true}),
                       target_);
      !made)
    return made;
  return device.create_buffers(std::vector<gpu::BufferRequest>{
      {&drawn_, {.name = name + " drawn", .size_bytes = std::size_t{pixels_} * images * word_pair_bytes}},
      {&paths_, {.name = name + " no paths", .size_bytes = sizeof(shared::PathRecord)}}});
}

Result<void> ImageRaster::bind(gpu::Device& device, const gpu::Buffer& cameras,
                               const accel::GeometryPool& pool, const accel::Tlas& tlas) {
  const std::size_t entities = entities_of(tlas.instances(0));
  if (visible_.size_bytes() != entities * sizeof(shared::VisibleRecord)) {
    auto made = device.create_buffers(std::vector<gpu::BufferRequest>{
        {&visible_, {.name = name_ + " visible", .size_bytes = entities * sizeof(shared::VisibleRecord)}},
        {&draws_,
         {.name = name_ + " draws", .size_bytes = entities * sizeof(gpu::DrawCommand), .indirect = true}}});
    if (!made) return made;
  }
  visible_bindings_.clear();
  for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
    const std::vector<const gpu::Buffer*> buffers{
        &cameras, &paths_, &tlas.instances(slot), &tlas.places(slot), &pool.geometries(), &visible_, &draws_};
    auto bindings = device.create_bindings(visible_kernel_, buffers);
    if (!bindings) return bindings.error();
    visible_bindings_.push_back(std::move(bindings).value());
  }
  const std::vector<const gpu::Buffer*> buffers{&pool.triangles(), &visible_};
  return keep(device.create_bindings(pipeline_, buffers), raster_bindings_);
}

void ImageRaster::record_warm_up(gpu::Recorder& recorder) const noexcept {
  recorder.dispatch(visible_kernel_, visible_bindings_.front(), shared::ImageArgs{}, 1);
  recorder.barrier();
  record_one_triangle(recorder);
  recorder.draw(pipeline_, raster_bindings_, {}, target_, draws_, 1);
  recorder.copy_words(target_, drawn_, 0);
  recorder.barrier();
}

void ImageRaster::record_one_triangle(gpu::Recorder& recorder) const noexcept {
  recorder.fill(visible_, 0, sizeof(shared::VisibleRecord), 0);
  constexpr gpu::DrawCommand triangle{.vertices = 3, .instances = 1, .first_vertex = 0, .first_instance = 0};
  recorder.fill(draws_, 0, 4, triangle.vertices);
  recorder.fill(draws_, 4, 4, triangle.instances);
  recorder.fill(draws_, 8, 8, 0);
  recorder.barrier();
}

void ImageRaster::record(std::uint32_t image, const shared::ImageArgs& args, const Recording& recording,
                         std::uint32_t max_groups) const noexcept {
  gpu::Recorder& recorder = recording.recorder;
  const std::uint32_t instances = recording.view.entities;
  dispatch_all(instances, image, args, max_groups, [&](const shared::ImageArgs& piece, std::uint32_t groups) {
    recorder.dispatch(visible_kernel_, visible_bindings_[recording.view.slot], piece, groups);
  });
  recorder.barrier();
  recorder.draw(pipeline_, raster_bindings_, {}, target_, draws_, instances);
  recorder.copy_words(target_, drawn_, std::size_t{image} * pixels_ * word_pair_bytes);
  recorder.barrier();  // the next image uses the same buffers
}

}  // namespace rtstdb::query
