#include "rtstdb/accel/geometry_pool.hpp"

#include <algorithm>
#include <cstring>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/closed_mesh.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr std::size_t node_bytes = 16 * shared::node_texels;
constexpr std::size_t triangle_bytes = 16 * shared::triangle_texels;

Result<gpu::Buffer> make_pool(gpu::Device& device, const char* name, std::size_t size_bytes,
                              bool holds_nodes) {
  gpu::BufferOptions options{.name = name, .size_bytes = size_bytes};
  options.texel_uint4 = holds_nodes;
  options.texel_float4 = !holds_nodes;
  return device.create_buffer(options);
}

template <class T>
Result<gpu::Buffer> upload(gpu::Device& device, const char* name, const std::vector<T>& values) {
  auto buffer = device.create_buffer(
      {.name = name, .size_bytes = values.size() * sizeof(T), .memory = gpu::Memory::upload});
  if (buffer) std::memcpy(buffer.value().host().data(), values.data(), values.size() * sizeof(T));
  return buffer;
}

}  // namespace

Result<GeometryPool> GeometryPool::create(gpu::Device& device, std::uint32_t tlas_nodes,
                                          std::uint32_t max_geometries) {
  GeometryPool pool;
  pool.max_geometries_ = max_geometries;
  pool.node_count_ = tlas_nodes;
  pool.node_capacity_ = tlas_nodes + 4096;
  pool.triangle_capacity_ = 16384;
  auto nodes = make_pool(device, "node pool", pool.node_capacity_ * node_bytes, true);
  if (!nodes) return nodes.error();
  pool.nodes_ = std::move(nodes).value();
  auto triangles = make_pool(device, "triangle pool", pool.triangle_capacity_ * triangle_bytes, false);
  if (!triangles) return triangles.error();
  pool.triangles_ = std::move(triangles).value();
  auto geometries = device.create_buffer({.name = "geometry table",
                                          .size_bytes = max_geometries * sizeof(shared::GeometryRecord),
                                          .memory = gpu::Memory::upload});
  if (!geometries) return geometries.error();
  pool.geometries_ = std::move(geometries).value();
  return pool;
}

Result<void> GeometryPool::reserve(gpu::Device& device, std::uint32_t nodes, std::uint32_t triangles,
                                   Submit& submit) {
  // Both looked at before either grows: a pool that no pass can bind would refuse every geometry after.
  const std::size_t largest_bytes = device.limits().max_storage_range_bytes;
  const auto needed_bytes = std::max(nodes * node_bytes, triangles * triangle_bytes);
  if (needed_bytes > largest_bytes) {
    return Error{ErrorCode::capacity, "all geometry together would need " + std::to_string(needed_bytes) +
                                          " bytes in one buffer, and the device binds at most " +
                                          std::to_string(largest_bytes)};
  }
  const auto grow = [&](gpu::Buffer& buffer, const char* name, std::uint32_t used, std::uint32_t wanted,
                        std::uint32_t& capacity, std::size_t element_bytes,
                        bool holds_nodes) -> Result<void> {
    if (wanted <= capacity) return {};
    // Half again as much keeps the number of copies low; where the device does not allow it, what is needed.
    const std::size_t generous = std::max<std::size_t>(wanted, std::size_t{capacity} + capacity / 2);
    const auto target = static_cast<std::uint32_t>(std::min(generous, largest_bytes / element_bytes));
    auto grown = make_pool(device, name, target * element_bytes, holds_nodes);
    if (!grown) return grown.error();
    submit.begin();
    submit.recorder().copy(buffer, 0, grown.value(), 0, used * element_bytes);
    if (!submit.run())
      return Error{ErrorCode::device_lost, "the GPU stopped answering while a geometry was added"};
    buffer = std::move(grown).value();
    capacity = target;
    ++generation_;
    return {};
  };
  if (auto done = grow(nodes_, "node pool", node_count_, nodes, node_capacity_, node_bytes, true); !done)
    return done;
  return grow(triangles_, "triangle pool", triangle_count_, triangles, triangle_capacity_, triangle_bytes,
              false);
}

Result<void> GeometryPool::build(gpu::Device& device, const TriangleMesh& mesh, Submit& submit,
                                 std::uint32_t& node_count) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  auto positions = upload(device, "positions", mesh.positions_m);
  if (!positions) return positions.error();
  auto corners = upload(device, "corners", mesh.triangles);
  if (!corners) return corners.error();
  auto scratch = BuildScratch::create(device, count, "BLAS");
  if (!scratch) return scratch.error();
  auto bounds_pipeline = device.create_pipeline(gpu::ShaderId::triangle_bounds);
  if (!bounds_pipeline) return bounds_pipeline.error();
  auto triangles_pipeline = device.create_pipeline(gpu::ShaderId::triangles);
  if (!triangles_pipeline) return triangles_pipeline.error();
  auto passes = LargeBuild::create(device);
  if (!passes) return passes.error();
  if (auto bound = passes.value().bind(device, scratch.value(), nodes_); !bound) return bound.error();

  const auto common = scratch.value().bindings(nodes_);
  std::vector<const gpu::Buffer*> buffers(common.begin(), common.end());
  buffers.insert(buffers.end(), {&positions.value(), &corners.value()});
  auto bounds_bindings = device.create_bindings(bounds_pipeline.value(), buffers);
  if (!bounds_bindings) return bounds_bindings.error();
  buffers.push_back(&triangles_);
  auto triangles_bindings = device.create_bindings(triangles_pipeline.value(), buffers);
  if (!triangles_bindings) return triangles_bindings.error();

  const shared::TriangleArgs args{.count = count, .leaf_base = triangle_count_};
  const Error lost{ErrorCode::device_lost, "the GPU stopped answering while a geometry was built"};
  submit.begin();
  submit.recorder().dispatch(bounds_pipeline.value(), bounds_bindings.value(), args, (count + 63) / 64);
  const auto built = passes.value().run({.count = count,
                                         .max_leaf = shared::max_triangles_per_leaf,
                                         .leaf_bits = 0,
                                         .leaf_base = triangle_count_,
                                         .node_base = node_count_},
                                        scratch.value(), submit);
  if (!built) return lost;
  submit.begin();
  submit.recorder().dispatch(triangles_pipeline.value(), triangles_bindings.value(), args, (count + 63) / 64);
  if (!submit.run()) return lost;
  node_count = *built;
  return {};
}

Result<std::uint32_t> GeometryPool::add(gpu::Device& device, const TriangleMesh& mesh, Submit& submit) {
  if (count_ == max_geometries_) {
    return Error{ErrorCode::capacity,
                 "the database was opened for " + std::to_string(max_geometries_) + " geometries"};
  }
  const std::size_t triangles = mesh.triangles.size();
  if (triangle_count_ + triangles > max_triangles_total) {
    return Error{ErrorCode::capacity, "a geometry of " + std::to_string(triangles) + " triangles on top of " +
                                          std::to_string(triangle_count_) + " passes the limit of " +
                                          std::to_string(max_triangles_total)};
  }
  const auto count = static_cast<std::uint32_t>(triangles);
  const std::uint32_t node_bound = wide_node_bound(count, shared::max_triangles_per_leaf);
  if (auto reserved = reserve(device, node_count_ + node_bound, triangle_count_ + count, submit); !reserved) {
    return reserved.error();
  }
  std::uint32_t node_count = 0;
  if (auto built = build(device, mesh, submit, node_count); !built) return built.error();
  const Bounds bounds = bounds_of(mesh);
  geometries_.host_as<shared::GeometryRecord>()[count_] = {
      .box_center_m = 0.5f * (bounds.minimum_m + bounds.maximum_m),
      .root = node_count_,
      .box_half_m = 0.5f * (bounds.maximum_m - bounds.minimum_m),
      .closed = is_closed(mesh) ? 1u : 0u};
  bounds_.push_back(bounds);
  node_count_ += node_count;
  triangle_count_ += count;
  return count_++;
}

}  // namespace rtstdb::accel
