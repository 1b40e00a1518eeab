#pragma once
// The bodies in an image: box, nearest depth and number of their visible pixels.
//
// Threads: one; find() does not allocate.

#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/entity.hpp>

namespace hil::modules {

/// x_min to y_max are the distances of the box's edges from the left and upper edge of the image, in pixels:
/// column 3 alone is x_min 3, x_max 4.
struct VisibleBody {
  rtstdb::EntityId entity{};
  std::uint32_t x_min = 0, y_min = 0, x_max = 0, y_max = 0;
  float depth_m = 0.0f;  ///< of its nearest pixel
  std::uint32_t pixels = 0;
};

class VisibleBodies {
 public:
  /// The most bodies that an image may show: the pixels of further ones are ignored and counted.
  static constexpr std::uint32_t max_bodies = 1024;

  VisibleBodies();
  /// `entities`: invalid where nothing is seen. Both spans are rows of `width` pixels, from the top left.
  void find(std::uint32_t width, std::span<const rtstdb::EntityId> entities,
            std::span<const float> depth_m) noexcept;
  /// Of the last find(): by depth, at equal depth by the index of the entity.
  std::span<const VisibleBody> nearest_first() const noexcept { return bodies_; }
  /// Of all calls of find().
  std::uint64_t ignored_pixels() const noexcept { return ignored_pixels_; }

 private:
  static constexpr std::uint32_t table_size = 4 * max_bodies;
  static constexpr std::uint32_t no_body = max_bodies;
  std::uint32_t place_of(rtstdb::EntityId entity) noexcept;

  std::vector<VisibleBody> bodies_;
  std::vector<std::uint32_t> table_;  // open addressing by entity index: places in bodies_
  std::uint64_t ignored_pixels_ = 0;
};

}  // namespace hil::modules
