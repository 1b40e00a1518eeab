#include "rtstdb/query/image/image_stages.hpp"

#include <algorithm>

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

#include "shaders/shared/image.h"

namespace rtstdb::query {
namespace {

static_assert(shared::image_tile_side == image_tile_px);

/// Pixels of a group whose tiles count as answered together: few where an unfinished image is of use.
constexpr std::uint32_t max_partial_group_pixels = 4096;

constexpr std::uint32_t stages_of_center = 3;

/// A multiple of the pixels of a tile.
std::uint32_t pixels_of_group(const ImageQueryOptions& options, std::uint32_t tiles_per_image,
                              std::uint32_t tile_pixels) noexcept {
  const std::uint32_t limit =
      options.late == LatePolicy::partial ? max_partial_group_pixels : shared::image_group_pixels;
  const std::uint64_t tiles = std::uint64_t{options.capacity} * tiles_per_image;
  return static_cast<std::uint32_t>(std::min<std::uint64_t>(tiles, limit / tile_pixels)) * tile_pixels;
}

}  // namespace

std::uint32_t tiles_along(std::uint32_t pixels) noexcept {
  return (pixels + image_tile_px - 1) / image_tile_px;
}

ImageStages::ImageStages(const ImageQueryOptions& options)
    : options_(options),
      tiles_per_image_(tiles_along(options.width) * tiles_along(options.height)),
      tile_pixels_(std::min(options.width, image_tile_px) * std::min(options.height, image_tile_px)),
      group_pixels_(pixels_of_group(options, tiles_per_image_, tile_pixels_)) {}

bool ImageStages::has_hit_outputs() const noexcept {
  const ImageOutputs& o = options_.outputs;
  return o.depth || o.identity || o.normal || o.motion;
}

std::uint64_t ImageStages::stages_per_group(std::uint64_t light_points) const noexcept {
  return (has_center() ? stages_of_center : 0) +
         (has_color() ? options_.samples_per_pixel * per_sample(light_points) : 0);
}

std::uint64_t ImageStages::max_stages() const noexcept {
  const std::uint64_t tiles = std::uint64_t{options_.capacity} * tiles_per_image_;
  const std::uint64_t groups = (tiles + tiles_per_group() - 1) / tiles_per_group();
  return 1 + groups * stages_per_group(std::uint64_t{max_lights_per_image} * options_.emitter_points);
}

void ImageStages::begin_batch(std::uint32_t tiles, std::uint32_t light_points) noexcept {
  tiles_ = tiles;
  groups_ = (tiles + tiles_per_group() - 1) / tiles_per_group();
  light_points_ = light_points;
}

ImageStages::Stage ImageStages::at(std::uint32_t stage) const noexcept {
  if (stage == 0)
    return {.step = Step::raster,
            .group = 0,
            .sample = center,
            .bounce = 0,
            .light_point = 0,
            .lobe = 0,
            .ray = 0};
  --stage;
  const std::uint32_t per_group = stages_per_group();
  RTSTDB_ASSERT(per_group > 0, "an image has no output");
  Stage at{.step = Step::rays,
           .group = stage / per_group,
           .sample = 0,
           .bounce = 0,
           .light_point = 0,
           .lobe = 0,
           .ray = 0};
  std::uint32_t k = stage % per_group;
  if (has_center()) {
    constexpr Step center_steps[stages_of_center] = {Step::rays, Step::trace, Step::hit_outputs};
    if (k < stages_of_center) {
      at.step = center_steps[k];
      at.sample = center;
      return at;
    }
    k -= stages_of_center;
  }
  const auto of_sample = static_cast<std::uint32_t>(per_sample(light_points_));
  at.sample = k / of_sample;
  k %= of_sample;
  if (k == 0) return at;
  if (k + 1 == of_sample) {
    at.step = Step::finish;
    return at;
  }
  set_step_of_sample(at, k - 1);
  return at;
}

std::uint32_t ImageStages::stages_of_lobes() const noexcept {
  return has_lobes() ? 2 + 3 * shared::lobes * options_.lobe_rays : 0;
}

/// The lobes come at the first surface, before its `shade`.
void ImageStages::set_step_of_sample(Stage& at, std::uint32_t k) const noexcept {
  const auto of_bounce = static_cast<std::uint32_t>(per_bounce(light_points_));
  const std::uint32_t first = of_bounce - 1;
  const std::uint32_t end = first + stages_of_lobes();
  if (k < first || k >= end) {
    if (k >= end) k -= stages_of_lobes();
    at.bounce = k / of_bounce;
    set_step_of_bounce(at, k % of_bounce);
  } else if (k == first || k + 1 == end) {
    at.step = k == first ? Step::keep : Step::restore;
  } else {
    constexpr Step ray_steps[] = {Step::lobe, Step::search, Step::gather};
    const std::uint32_t of_lobes = k - first - 1;
    at.step = ray_steps[of_lobes % 3];
    at.ray = of_lobes / 3 % options_.lobe_rays;
    at.lobe = of_lobes / 3 / options_.lobe_rays;
  }
}

/// Path tracer: trace, shade, shadow. Real-time mode: trace, light and shadow for each point, shade. After
/// the last bounce there is no light but that which the ray meets: trace and shade.
void ImageStages::set_step_of_bounce(Stage& at, std::uint32_t k) const noexcept {
  const bool is_last_bounce = at.bounce == options_.bounces;
  if (k == 0) {
    at.step = Step::trace;
  } else if (!is_real_time()) {
    at.step = k == 1 ? Step::shade : Step::shadow;
  } else if (is_last_bounce || k + 1 == per_bounce(light_points_)) {
    at.step = Step::shade;
  } else {
    at.step = k % 2 == 1 ? Step::light : Step::shadow;
    at.light_point = (k - 1) / 2;
  }
}

std::uint32_t ImageStages::places_of_group(std::uint32_t group) const noexcept {
  const std::uint32_t first = group * tiles_per_group();
  return std::min(tiles_ - first, tiles_per_group()) * tile_pixels_;
}

}  // namespace rtstdb::query
