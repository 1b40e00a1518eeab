#include "rtstdb/accel/deforming_geometry.hpp"

#include <algorithm>
#include <utility>

#include "rtstdb/accel/build_scratch.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr std::size_t node_bytes = 16 * shared::node_texels;
constexpr std::size_t triangle_bytes = 16 * shared::triangle_texels;
/// Per node: low corner and cost, high corner and least cost.
constexpr std::size_t box_bytes = 32;
/// The node visits of a ray through the root of a good tree over small triangles. Together with the cost of
/// the triangles alone it estimates the least cost of a shape.
constexpr float node_visits = 10.0f;
/// Places satisfy any storage alignment of up to 256 bytes.
static_assert(DeformingGeometry::alignment * node_bytes % 256 == 0);
static_assert(DeformingGeometry::alignment * triangle_bytes % 256 == 0);

constexpr std::uint32_t rounded_up(std::uint32_t count) {
  constexpr std::uint32_t step = DeformingGeometry::alignment;
  return (count + step - 1) / step * step;
}

float half_area(const Bounds& box) {
  const glm::vec3 e = box.maximum_m - box.minimum_m;
  return e.x * e.y + e.y * e.z + e.z * e.x;
}

}  // namespace

Result<RefitPasses> RefitPasses::create(gpu::Device& device) {
  RefitPasses passes;
  auto triangles = device.create_pipeline(gpu::ShaderId::blas_refit_triangles);
  if (!triangles) return triangles.error();
  passes.triangles = std::move(triangles).value();
  auto nodes = device.create_pipeline(gpu::ShaderId::blas_refit);
  if (!nodes) return nodes.error();
  passes.nodes = std::move(nodes).value();
  return passes;
}

DeformingGeometry::Capacity DeformingGeometry::capacity_for(std::uint32_t triangles) noexcept {
  return {rounded_up(wide_node_bound(triangles, shared::blas_always_leaf)), rounded_up(triangles)};
}

Result<DeformingGeometry> DeformingGeometry::create(gpu::Device& device, GeometryId id,
                                                    const TriangleMesh& mesh, const GeometryOptions& options,
                                                    const std::array<BlasBuilder::Place, places>& at) {
  DeformingGeometry geometry;
  geometry.id_ = id;
  geometry.triangles_ = mesh.triangles;
  geometry.position_count_ = mesh.positions_m.size();
  geometry.closed_shapes_ = ClosedShapes(mesh);
  geometry.rebuild_growth_ = options.rebuild_growth;
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  const std::size_t largest = device.limits().max_storage_range_bytes / triangle_bytes;
  if (count > largest) {
    return Error{ErrorCode::capacity, "a geometry that deforms of " + std::to_string(count) +
                                          " triangles exceeds the limit of " + std::to_string(largest) +
                                          " on " + device.info().name};
  }
  const Capacity capacity = capacity_for(count);
  gpu::BufferOptions positions{.name = "deformed positions",
                               .size_bytes = 16 * geometry.position_count_,
                               .memory = gpu::Memory::upload};
  positions.texel_float4 = true;
  gpu::BufferOptions boxes{.name = "deformed boxes", .size_bytes = box_bytes * capacity.nodes};
  boxes.texel_float4 = true;
  gpu::BufferOptions order{.name = "deformed order", .size_bytes = 16 * std::size_t{count}};
  order.texel_uint4 = true;
  order.addressed = true;
  const gpu::BufferRequest wanted[] = {
      {&geometry.positions_, positions},
      {&geometry.boxes_, boxes},
      {&geometry.root_readback_,
       {.name = "deformed root", .size_bytes = box_bytes, .memory = gpu::Memory::readback}},
      {&geometry.places_[0].order, order},
      {&geometry.places_[1].order, order},
  };
  if (auto made = device.create_buffers(wanted); !made) return made.error();
  for (std::size_t place = 0; place < places; ++place) {
    geometry.places_[place].at = at[place];
    geometry.places_[place].levels.reserve(BlasBuilder::max_levels);
  }
  return geometry;
}

Result<void> DeformingGeometry::bind(gpu::Device& device, const RefitPasses& passes, const gpu::Buffer& nodes,
                                     const gpu::Buffer& triangles) {
  const Capacity capacity = capacity_for(static_cast<std::uint32_t>(triangles_.size()));
  // Unbind all places first, so that no binding refers to a destroyed buffer when a later one fails.
  for (Held& held : places_) {
    held.triangles_pass = {};
    held.nodes_pass = {};
  }
  for (Held& held : places_) {
    const gpu::BufferPart own_nodes{&nodes, held.at.node_base * node_bytes, capacity.nodes * node_bytes};
    const gpu::BufferPart own_triangles{&triangles, held.at.leaf_base * triangle_bytes,
                                        triangles_.size() * triangle_bytes};
    const gpu::BufferPart triangle_parts[] = {{&held.order}, {&positions_}, own_triangles};
    auto triangles_pass = device.create_bindings(passes.triangles, triangle_parts);
    if (!triangles_pass) return triangles_pass.error();
    const gpu::BufferPart node_parts[] = {own_nodes, {&nodes}, {&triangles}, {&boxes_}, {&boxes_}};
    auto nodes_pass = device.create_bindings(passes.nodes, node_parts);
    if (!nodes_pass) return nodes_pass.error();
    held.triangles_pass = std::move(triangles_pass).value();
    held.nodes_pass = std::move(nodes_pass).value();
  }
  return {};
}

void DeformingGeometry::adopt_tree(std::size_t place, std::span<const std::uint32_t> levels) noexcept {
  places_[place].levels.assign(levels.begin(), levels.end());
  places_[place].tree_is_new = true;
}

void DeformingGeometry::adopt_tree(std::size_t place, std::span<const std::uint32_t> levels,
                                   float built_cost_ratio) noexcept {
  adopt_tree(place, levels);
  places_[place].built_cost_ratio = built_cost_ratio;
  places_[place].tree_is_new = false;
}

DeformingGeometry::Held* DeformingGeometry::holder_of(Version shape) noexcept {
  const auto holder = std::ranges::find_if(
      places_, [&](const Held& held) { return held.holds_shape && held.shape == shape; });
  return holder == places_.end() ? nullptr : &*holder;
}

std::size_t DeformingGeometry::find(Version shape) noexcept {
  Held* const held = holder_of(shape);
  if (held == nullptr) return places;
  shown_place_ = static_cast<std::size_t>(held - places_.data());
  held->last_shown = ++shows_;
  return shown_place_;
}

std::size_t DeformingGeometry::evict_oldest() noexcept {
  const auto oldest = std::ranges::min_element(
      places_, {}, [](const Held& held) { return std::pair(held.pins > 0, held.last_shown); });
  RTSTDB_ASSERT(oldest->pins == 0, "each shape on the device is in use");
  oldest->holds_shape = false;
  return static_cast<std::size_t>(oldest - places_.begin());
}

bool DeformingGeometry::pin(Version shape) noexcept {
  Held* const held = holder_of(shape);
  RTSTDB_ASSERT(held != nullptr, "the shape is not on the device");
  const bool leaves_one =
      std::ranges::any_of(places_, [&](const Held& other) { return &other != held && other.pins == 0; });
  if (!leaves_one) return false;
  ++held->pins;
  return true;
}

void DeformingGeometry::unpin(Version shape) noexcept {
  Held* const held = holder_of(shape);
  RTSTDB_ASSERT(held != nullptr && held->pins > 0, "the shape is not in use");
  --held->pins;
}

void DeformingGeometry::upload(std::span<const glm::vec3> positions_m) {
  RTSTDB_ASSERT(positions_m.size() == position_count_, "the number of positions is not that of the geometry");
  const auto texels = positions_.host_as<glm::vec4>();
  for (std::size_t i = 0; i < positions_m.size(); ++i)
    texels[i] = glm::vec4(positions_m[i], 0.0f);
  uploaded_closed_ = closed_shapes_.is_closed({positions_m, triangles_});
}

void DeformingGeometry::record_refit(std::size_t place, const RefitPasses& passes,
                                     gpu::Recorder& recorder) const {
  const Held& held = places_[place];
  const auto count = static_cast<std::uint32_t>(triangles_.size());
  shared::BlasRefitArgs args{.first = 0, .count = count, .node_base = held.at.node_base};
  recorder.dispatch(passes.triangles, held.triangles_pass, args,
                    (count + shared::blas_tile - 1) / shared::blas_tile);
  recorder.barrier();
  for (std::size_t level = held.levels.size() - 1; level-- > 0;) {
    args.first = held.levels[level];
    args.count = held.levels[level + 1] - held.levels[level];
    recorder.dispatch(passes.nodes, held.nodes_pass, args, (args.count + 63) / 64);
    recorder.barrier();
  }
  recorder.copy(boxes_, 0, root_readback_, 0, box_bytes);
}

void DeformingGeometry::finish_refit(std::size_t place, Version shape, std::uint64_t refit_number) {
  Held& held = places_[place];
  const auto root = root_readback_.host_as<const glm::vec4>();
  const Bounds bounds{glm::vec3(root[0]), glm::vec3(root[1])};
  // No ray passes through a root without area.
  const float area = half_area(bounds);
  held.cost_ratio = area > 0.0f ? root[0].w / (root[1].w + node_visits * area) : 0.0f;
  if (std::exchange(held.tree_is_new, false)) held.built_cost_ratio = held.cost_ratio;
  held.holds_shape = true;
  held.shape = shape;
  held.shown = {.at = held.at, .bounds = bounds, .closed = uploaded_closed_, .refit_number = refit_number};
  shown_place_ = place;
  held.last_shown = ++shows_;
}

bool DeformingGeometry::needs_rebuild(std::size_t place) const noexcept {
  return places_[place].cost_ratio > rebuild_growth_ * places_[place].built_cost_ratio;
}

DeformingGeometry::Shown DeformingGeometry::shown() const noexcept {
  return places_[shown_place_].shown;
}

}  // namespace rtstdb::accel
