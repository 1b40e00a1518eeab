#include "rtstdb/accel/build_scratch.hpp"

#include <utility>

namespace rtstdb::accel {

std::uint32_t wide_node_bound(std::uint32_t primitives, std::uint32_t max_leaf) noexcept {
  const std::uint64_t n = primitives;
  const std::uint64_t narrow = max_leaf < 7 ? n * (7 - max_leaf) / (7ull * (max_leaf + 1)) : 0;
  return static_cast<std::uint32_t>(n / 7 + narrow + 2);
}

Result<BuildScratch> BuildScratch::create(gpu::Device& device) {
  BuildScratch scratch;
  constexpr std::size_t n = shared::small_build_max;
  const gpu::BufferRequest wanted[] = {
      {&scratch.keys_, {.name = "small build keys", .size_bytes = 8 * n}},
      {&scratch.values_, {.name = "small build values", .size_bytes = 4 * n}},
      {&scratch.binary_, {.name = "small build binary", .size_bytes = 16 * n}},
      {&scratch.parents_, {.name = "small build parents", .size_bytes = 2 * 4 * n}},
      {&scratch.node_bounds_, {.name = "small build node bounds", .size_bytes = 24 * n}},
      {&scratch.arrivals_, {.name = "small build arrivals", .size_bytes = 4 * n}},
      {&scratch.queue_, {.name = "small build queue", .size_bytes = 2 * 8 * n}},
      {&scratch.offsets_, {.name = "small build offsets", .size_bytes = 4 * n}},
  };
  if (auto made = device.create_buffers(wanted); !made) return made.error();
  return scratch;
}

std::array<const gpu::Buffer*, BuildScratch::binding_count> BuildScratch::bindings(
    const gpu::Buffer& bounds, const gpu::Buffer& nodes) const noexcept {
  return {&bounds,       &keys_,     &values_, &binary_,  &parents_,
          &node_bounds_, &arrivals_, &queue_,  &offsets_, &nodes};
}

}  // namespace rtstdb::accel
