#pragma once
// The image query on the GPU. A batch passes through the stages of ImageStages. `trace` is the search of
// rays, with the kernels of ray queries; `shade` adds light that was found and writes the next rays;
// `shadow` is the search of rays to lights; `finish` adds the sample to the sum. Kernels are in
// shaders/query/image.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "rtstdb/query/image/image_answers.hpp"
#include "rtstdb/query/image/image_lights.hpp"
#include "rtstdb/query/image/image_raster.hpp"
#include "rtstdb/query/image/image_stages.hpp"
#include "rtstdb/query/image/shadow_maps.hpp"
#include "rtstdb/query/ray/ray_search.hpp"

namespace rtstdb::query {

class GpuImageQuery final : public ImageQuery, public GpuQuery {
 public:
  /// The options have passed check_image_options.
  explicit GpuImageQuery(const ImageQueryOptions& options);
  ~GpuImageQuery() override { leave(); }

  std::span<Camera> cameras() noexcept override { return cameras_; }
  std::span<const Image> images() const noexcept override {
    return answers_.images(slots().read()).first(slots().readable() / stages_.tiles_per_image());
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }

  CostClass cost_class() const noexcept override {
    return is_real_time() ? CostClass::image_real_time : CostClass::image_path_traced;
  }
  std::uint32_t parts_per_element() const noexcept override { return stages_.tiles_per_image(); }
  std::optional<BadInput> check(std::uint32_t tiles, const RowSource& rows,
                                TimeSpan& times) const noexcept override;
  std::uint32_t incomplete(std::uint32_t answered) const noexcept override {
    return answers_.incomplete_tiles(answered);
  }
  std::uint32_t next_retry_batch() noexcept override;
  std::uint32_t min_retry_batch() const noexcept override { return closest_.min_retry_batch(limits()); }
  double places_per_element() const noexcept override {
    return static_cast<double>(stages_.tile_pixels()) * stages_.stages_per_group();
  }
  void record(const BatchPart& part, const Recording& recording) noexcept override;

 private:
  using Step = ImageStages::Step;
  static constexpr std::uint32_t center = ImageStages::center;

  DeviceNeeds device_needs(const gpu::DeviceLimits& limits) override;
  std::vector<const gpu::Buffer*> bound_buffers(gpu::ShaderId shader, std::uint32_t slot,
                                                const accel::GeometryPool& pool,
                                                const accel::Tlas& tlas) const override;
  void initialize_buffers() noexcept override;
  Result<void> create_more(gpu::Device& device) override;
  Result<void> bind_more(gpu::Device& device, const accel::GeometryPool& pool,
                         const accel::Tlas& tlas) override;
  void destroy_more() noexcept override {
    raster_.destroy();
    maps_.destroy();
  }
  void record_more_warm_up(gpu::Recorder& recorder) noexcept override;
  void unpack(const BatchPart& part, const accel::TlasView& view) noexcept override;
  bool is_incomplete(std::uint32_t place) const noexcept override;
  void mark_incomplete(std::uint32_t tile) noexcept override { answers_.add_missing(tile); }
  std::uint32_t stages() const noexcept override { return stages_.count(); }
  std::uint32_t answered_after(std::uint32_t stage, std::uint32_t count) const noexcept override {
    return std::min(stages_.tiles_after(stage), count);
  }
  std::uint32_t begin_first_stage(std::uint32_t tiles, const BatchWorld& world) noexcept override;
  std::uint32_t begin_stage(std::uint32_t stage, const BatchWorld& world) noexcept override;

  bool is_real_time() const noexcept { return stages_.is_real_time(); }
  std::uint32_t zones_per_emitter() const noexcept { return is_real_time() ? options_.emitter_points : 0; }
  gpu::ShaderId gather_shader() const noexcept;
  /// Keeps or restores the first hits of the group while hits_ has those of the lobes.
  void copy_hits(PlaceRange range, const Recording& recording) noexcept;
  bool has_maps() const noexcept { return options_.shadows == Shadows::mapped; }
  gpu::ShaderId shade_shader() const noexcept;
  std::uint32_t draws_per_image() const noexcept { return 1 + lights_.counts().maps; }
  bool uses_raster() const noexcept { return raster_.exists(); }
  std::size_t kernel_of_stage() const noexcept;
  shared::ImageArgs args_of(const BatchPart& part, const Recording& recording) const noexcept;
  /// Begins a stage of the group: what it reads and what it skips. Returns its places.
  std::uint32_t begin(const ImageStages::Stage& stage) noexcept;
  bool searches() const noexcept {
    return now_.step == Step::trace || now_.step == Step::shadow || now_.step == Step::search;
  }
  /// The stage's first hits come from the rasteriser; what that leaves incomplete is traced in its retries.
  bool is_drawn_stage() const noexcept { return uses_raster() && now_.sample == center; }
  RaySearch& search() noexcept { return now_.step == Step::shadow ? any_ : closest_; }
  std::span<RayHit> searched_hits() const noexcept {
    return (now_.step == Step::shadow ? shadow_hits_ : hits_).host_as<RayHit>();
  }
  /// Draws place `place` of the raster stage: for each image its first hits, then its shadow maps.
  void draw(std::uint32_t place, const shared::ImageArgs& args, const Recording& recording) noexcept;
  /// Returns the bits of all masks.
  std::uint32_t pack_cameras() noexcept;
  void pack_materials(const Appearance& appearance) noexcept;
  /// Counts the pixels of the group whose search was left incomplete in the stage that ends.
  void count_incomplete_pixels() noexcept;
  bool is_coherent() const noexcept;

  const ImageQueryOptions options_;
  ImageStages stages_;
  std::vector<Camera> cameras_;
  RaySearch closest_, any_;
  ImageAnswers answers_;
  ImageLights lights_;
  ImageRaster raster_;  // not used: FirstHits::traced, or the device can not draw
  ShadowMaps maps_;     // not used: Shadows::traced, or the device can not draw
  std::uint32_t packed_materials_ = 0;

  std::uint32_t tiles_ = 0;  // of the batch
  ImageStages::Stage now_;
  bool writes_second_ = false;        // which of the two states of paths the stage writes
  std::uint32_t listed_count_ = 0;    // of listed_
  std::vector<std::uint32_t> noted_;  // places that a search left incomplete at first

  gpu::Buffer cameras_buffer_, paths_, rays_, shadow_rays_, hits_, shadow_hits_, materials_, lights_buffer_,
      emitters_, zones_, zone_points_, albedo_, activity_, listed_, first_hits_;
};

}  // namespace rtstdb::query
