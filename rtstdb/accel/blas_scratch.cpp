#include <algorithm>

#include "rtstdb/accel/blas_builder.hpp"
#include "rtstdb/accel/build_scratch.hpp"
#include "rtstdb/accel/tree_buffers.hpp"

namespace rtstdb::accel {
namespace {

constexpr std::uint32_t min_capacity = 1024;

}  // namespace

Result<BlasScratch> BlasScratch::create(gpu::Device& device, std::uint32_t triangles, std::size_t positions) {
  // Bytes per triangle of the largest storage binding (the keys) and texels per triangle of the largest texel
  // buffer (the tree).
  constexpr std::size_t bytes_per_triangle = 16;
  constexpr std::size_t texels_per_triangle = 6;
  const gpu::DeviceLimits& limits = device.limits();
  const std::size_t most = std::min(limits.max_storage_range_bytes / bytes_per_triangle,
                                    limits.max_texel_elements / texels_per_triangle);
  if (triangles > most) {
    return Error{ErrorCode::capacity,
                 "a geometry of " + std::to_string(triangles) + " triangles exceeds the limit of " +
                     std::to_string(most) + ", as " + device.info().name + " binds at most " +
                     std::to_string(limits.max_storage_range_bytes) + " bytes of storage and " +
                     std::to_string(limits.max_texel_elements) + " texels"};
  }
  BlasScratch scratch;
  scratch.capacity_ = std::max(triangles + triangles % 2, min_capacity);
  scratch.positions_capacity_ = std::max<std::size_t>(positions, min_capacity);
  const std::size_t n = scratch.capacity_;
  const std::size_t nodes = wide_node_bound(scratch.capacity_, shared::blas_always_leaf);
  const std::size_t state_bytes = 4 * shared::blas_state_words;
  const auto upload = gpu::Memory::upload;
  const gpu::BufferRequest wanted[] = {
      {&scratch.positions_,
       {.name = "geometry positions",
        .size_bytes = 16 * scratch.positions_capacity_,
        .memory = upload,
        .texel_float4 = true}},
      {&scratch.corners_,
       {.name = "geometry corners", .size_bytes = 16 * n, .memory = upload, .texel_uint4 = true}},
      {&scratch.sorted_, RadixSort::sorted_buffer("geometry keys", n)},
      {&scratch.low_words_, {.name = "geometry words", .size_bytes = 2 * 4 * n}},
      {&scratch.offsets_, RadixSort::counts_buffer("geometry offsets", n)},
      {&scratch.tree_, tree_buffer("geometry tree", n)},
      {&scratch.binary_, binary_buffer("geometry binary", n)},
      {&scratch.arrivals_, {.name = "geometry arrivals", .size_bytes = 4 * n}},
      {&scratch.queue_, {.name = "geometry queue", .size_bytes = 16 * nodes}},
      {&scratch.children_, {.name = "geometry children", .size_bytes = 32 * nodes}},
      {&scratch.state_, {.name = "geometry state", .size_bytes = state_bytes, .indirect = true}},
      {&scratch.state_readback_,
       {.name = "geometry state readback", .size_bytes = state_bytes, .memory = gpu::Memory::readback}},
  };
  if (auto made = device.create_buffers(wanted); !made) return made.error();
  return scratch;
}

void BlasScratch::upload(const MeshView& mesh) const {
  const auto positions = positions_.host_as<glm::vec4>();
  for (std::size_t i = 0; i < mesh.positions_m.size(); ++i)
    positions[i] = glm::vec4(mesh.positions_m[i], 0.0f);
  const auto corners = corners_.host_as<glm::uvec4>();
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i)
    corners[i] = glm::uvec4(mesh.triangles[i], i);
}

std::array<const gpu::Buffer*, 11> BlasScratch::bindings() const noexcept {
  return {&corners_, &positions_, &sorted_, &low_words_, &offsets_, &tree_,
          &binary_,  &arrivals_,  &queue_,  &state_,     &children_};
}

}  // namespace rtstdb::accel
