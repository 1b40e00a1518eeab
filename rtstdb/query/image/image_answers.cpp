#include "rtstdb/query/image/image_answers.hpp"

#include <algorithm>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

ImageAnswers::ImageAnswers(const ImageQueryOptions& options, const ImageStages& stages, std::size_t slots)
    : stages_(stages),
      tiles_across_(tiles_along(options.width)),
      height_(options.height),
      is_incomplete_pixel_(stages.group_pixels()),
      is_incomplete_tile_(std::size_t{options.capacity} * stages.tiles_per_image()) {
  for (std::size_t k = 0; k < slots; ++k) {
    Slot& slot = slots_.emplace_back(ImageBuffers(options), std::vector<Image>(options.capacity),
                                     std::vector<std::uint32_t>());
    slot.missing.reserve(is_incomplete_tile_.size());
    for (std::uint32_t image = 0; image < options.capacity; ++image)
      slot.buffers.set_spans(image, slot.images[image]);
  }
}

void ImageAnswers::add_needs(DeviceNeeds& needs, const std::string& name) {
  for (Slot& slot : slots_)
    slot.buffers.add_needs(needs, name);
}

void ImageAnswers::begin_batch(std::size_t slot) noexcept {
  written_ = slot;
  std::ranges::fill(is_incomplete_tile_, std::uint8_t{0});
  slots_[slot].missing.clear();
  for (Image& image : slots_[slot].images) {
    image.missing_tiles = {};
    image.incomplete_pixels = 0;
    image.lights_overflow = false;
  }
}

void ImageAnswers::begin_group() noexcept {
  std::ranges::fill(is_incomplete_pixel_, std::uint8_t{0});
}

void ImageAnswers::note_overflow_of_lights() noexcept {
  for (Image& image : slots_[written_].images)
    image.lights_overflow = true;
}

void ImageAnswers::set_addresses(std::uint32_t image, shared::CameraRecord& camera) const noexcept {
  slots_[written_].buffers.set_addresses(image, camera);
}

void ImageAnswers::note_incomplete(std::uint32_t group, std::uint32_t place) noexcept {
  if (is_incomplete_pixel_[place] != 0) return;
  is_incomplete_pixel_[place] = 1;
  const std::uint32_t tile = group * stages_.tiles_per_group() + place / stages_.tile_pixels();
  is_incomplete_tile_[tile] = 1;
  ++slots_[written_].images[tile / stages_.tiles_per_image()].incomplete_pixels;
}

std::uint32_t ImageAnswers::incomplete_tiles(std::uint32_t tiles) const noexcept {
  return static_cast<std::uint32_t>(std::ranges::count(std::span(is_incomplete_tile_).first(tiles), 1));
}

void ImageAnswers::add_missing(std::uint32_t tile) noexcept {
  Slot& slot = slots_[written_];
  const std::uint32_t image = tile / stages_.tiles_per_image();
  const std::uint32_t in_image = tile % stages_.tiles_per_image();
  slot.buffers.clear_tile(image, in_image);
  // In ascending order, so those of one image are neighbours.
  slot.missing.push_back(in_image);
  Image& incomplete = slot.images[image];
  const std::size_t count = incomplete.missing_tiles.size() + 1;
  incomplete.missing_tiles = std::span(slot.missing).last(count);
}

void ImageAnswers::pull_group(std::uint32_t group) const noexcept {
  const std::uint32_t per_image = stages_.tiles_per_image();
  const std::uint32_t first = group * stages_.tiles_per_group();
  const std::uint32_t end = first + stages_.places_of_group(group) / stages_.tile_pixels();
  for (std::uint32_t tile = first; tile < end;) {
    const std::uint32_t image = tile / per_image;
    const std::uint32_t image_end = std::min(end, (image + 1) * per_image);
    const std::uint32_t first_row = tile % per_image / tiles_across_ * image_tile_px;
    const std::uint32_t last_row = (image_end - 1) % per_image / tiles_across_ * image_tile_px;
    slots_[written_].buffers.pull_rows(image, first_row, std::min(last_row + image_tile_px, height_));
    tile = image_end;
  }
}

}  // namespace rtstdb::query
