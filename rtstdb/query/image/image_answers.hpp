#pragma once
// The images of a query as its caller reads them: outputs, missing tiles and incomplete pixels, for each
// answer slot. A batch writes one slot.
//
// Threads: the engine thread, but for `images`, which the caller reads. Nothing allocates after construction.

#include <cstdint>
#include <string>
#include <vector>

#include "rtstdb/query/image/image_buffers.hpp"
#include "rtstdb/query/image/image_stages.hpp"

namespace rtstdb::query {

class ImageAnswers {
 public:
  /// `stages` outlives this.
  ImageAnswers(const ImageQueryOptions& options, const ImageStages& stages, std::size_t slots);

  std::span<const Image> images(std::size_t slot) const noexcept { return slots_[slot].images; }
  void add_needs(DeviceNeeds& needs, const std::string& name);

  /// A batch begins, which writes this slot.
  void begin_batch(std::size_t slot) noexcept;
  void begin_group() noexcept;
  void note_overflow_of_lights() noexcept;
  /// Sets where the outputs of an image lie on the device.
  void set_addresses(std::uint32_t image, shared::CameraRecord& camera) const noexcept;
  /// A search for the pixel at a place of the group was incomplete.
  void note_incomplete(std::uint32_t group, std::uint32_t place) noexcept;
  /// How many of the first `tiles` tiles of the batch have an incomplete pixel.
  std::uint32_t incomplete_tiles(std::uint32_t tiles) const noexcept;
  /// The batch ends without this tile. In ascending order.
  void add_missing(std::uint32_t tile) noexcept;
  /// Makes the outputs of a group visible to the host.
  void pull_group(std::uint32_t group) const noexcept;

 private:
  struct Slot {
    ImageBuffers buffers;
    std::vector<Image> images;
    std::vector<std::uint32_t> missing;  // of all images
  };

  const ImageStages& stages_;
  const std::uint32_t tiles_across_, height_;
  std::vector<Slot> slots_;
  std::size_t written_ = 0;
  std::vector<std::uint8_t> is_incomplete_pixel_;  // by place of the group
  std::vector<std::uint8_t> is_incomplete_tile_;   // by tile of the batch
};

}  // namespace rtstdb::query
