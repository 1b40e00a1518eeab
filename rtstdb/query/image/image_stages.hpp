#pragma once
// Which stages a batch of images passes through. Its tiles are divided into groups. Stage 0 draws all images
// with the rasteriser. Then each group in turn: the ray through the middle of each pixel, and what it hits;
// for each sample `rays`, then for each bounce `trace` and `shade` with the shadow rays of its lights, and
// `finish`.

#include <cstdint>

#include <rtstdb/image.hpp>

namespace rtstdb::query {

class ImageStages {
 public:
  enum class Step : std::uint8_t {
    raster,       ///< draws the first hits and the shadow maps of all images
    rays,         ///< makes the rays of a sample
    trace,        ///< searches the closest hits of the rays
    hit_outputs,  ///< writes the outputs that follow from the hit of the middle ray: all but colour
    light,        ///< real-time mode: makes shadow rays to one point of the lights
    shadow,       ///< searches whether something is on the shadow rays
    keep,         ///< real-time mode, as the next four: copies the first hits, since `search` overwrites them
    lobe,         ///< makes rays from the first surfaces into a lobe
    search,       ///< searches their hits
    gather,       ///< adds the light that comes from them
    restore,      ///< copies the first hits back
    shade,        ///< adds the light at the hits, and makes the rays of the next bounce
    finish        ///< adds the sample to the colours; after the last one, writes them
  };
  /// Stands for the ray through the middle of pixel and exposure.
  static constexpr std::uint32_t center = 0xFFFFFFFFu;
  struct Stage {
    Step step = Step::rays;
    std::uint32_t group = 0;
    std::uint32_t sample = 0;  // or `center`
    std::uint32_t bounce = 0;
    std::uint32_t light_point = 0;    // of Step::light and its Step::shadow: the index of the point
    std::uint32_t lobe = 0, ray = 0;  // of Step::lobe, Step::search and Step::gather
  };

  explicit ImageStages(const ImageQueryOptions& options);

  // ---- of the options

  std::uint32_t tiles_per_image() const noexcept { return tiles_per_image_; }
  std::uint32_t tile_pixels() const noexcept { return tile_pixels_; }
  /// Places of a stage, at most.
  std::uint32_t group_pixels() const noexcept { return group_pixels_; }
  std::uint32_t tiles_per_group() const noexcept { return group_pixels_ / tile_pixels_; }
  bool is_real_time() const noexcept { return options_.mode == ImageMode::real_time; }
  bool has_color() const noexcept { return options_.outputs.color || options_.outputs.srgb; }
  /// Whether an output other than colour is chosen.
  bool has_hit_outputs() const noexcept;
  /// Real-time mode: the only sample of a pixel is the ray through its middle, as for the other outputs.
  bool colors_center() const noexcept {
    return is_real_time() && has_color() && options_.samples_per_pixel == 1;
  }
  /// Rays search the lobes of the first surface, if light may be reflected twice.
  bool has_lobes() const noexcept { return is_real_time() && has_color() && options_.bounces >= 2; }
  bool has_center() const noexcept { return has_hit_outputs() || colors_center(); }
  /// The most stages that a batch can have.
  std::uint64_t max_stages() const noexcept;

  // ---- of a batch

  /// `light_points`: of all lights; only real-time mode uses it.
  void begin_batch(std::uint32_t tiles, std::uint32_t light_points) noexcept;
  std::uint32_t count() const noexcept { return 1 + groups_ * stages_per_group(); }
  std::uint32_t stages_per_group() const noexcept {
    return static_cast<std::uint32_t>(stages_per_group(light_points_));
  }
  Stage at(std::uint32_t stage) const noexcept;
  std::uint32_t places_of_group(std::uint32_t group) const noexcept;
  /// Tiles that are complete after a stage.
  std::uint32_t tiles_after(std::uint32_t stage) const noexcept {
    return stage / stages_per_group() * tiles_per_group();
  }

 private:
  std::uint64_t per_bounce(std::uint64_t light_points) const noexcept {
    return is_real_time() ? 2 + 2 * light_points : 3;
  }
  std::uint64_t per_sample(std::uint64_t light_points) const noexcept {
    return per_bounce(light_points) * options_.bounces + stages_of_lobes() + 4;
  }
  std::uint64_t stages_per_group(std::uint64_t light_points) const noexcept;
  std::uint32_t stages_of_lobes() const noexcept;
  /// Stage `k` of a sample, after `rays`.
  void set_step_of_sample(Stage& at, std::uint32_t k) const noexcept;
  void set_step_of_bounce(Stage& at, std::uint32_t k) const noexcept;

  const ImageQueryOptions& options_;
  std::uint32_t tiles_per_image_, tile_pixels_, group_pixels_;
  std::uint32_t tiles_ = 0, groups_ = 0, light_points_ = 0;  // of the batch
};

std::uint32_t tiles_along(std::uint32_t pixels) noexcept;

}  // namespace rtstdb::query
