#include "rtstdb/accel/geometry_pool.hpp"

#include <algorithm>

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
  options.texel_uint4 = true;
  options.texel_float4 = !holds_nodes;
  options.texel_image = true;
  options.addressed = true;
  return device.create_buffer(options);
}

}  // namespace

Result<GeometryPool> GeometryPool::create(gpu::Device& device, std::uint32_t max_geometries, Submit& submit) {
  return create_with_room(device, max_geometries, {}, submit);
}

Result<GeometryPool> GeometryPool::create_with_room(gpu::Device& device, std::uint32_t max_geometries,
                                                    const PoolPart& used, Submit& submit) {
  GeometryPool pool;
  auto builder = BlasBuilder::create(device, submit);
  if (!builder) return builder.error();
  pool.builder_ = std::move(builder).value();
  auto passes = RefitPasses::create(device);
  if (!passes) return passes.error();
  pool.refit_passes_ = std::move(passes).value();
  pool.max_geometries_ = max_geometries;
  pool.node_capacity_ = std::max(used.node_end, 4096u);
  pool.triangle_capacity_ = std::max(used.triangle_end, 16384u);
  auto nodes = make_pool(device, "node pool", pool.node_capacity_ * node_bytes, true);
  if (!nodes) return nodes.error();
  pool.nodes_ = std::move(nodes).value();
  auto triangles = make_pool(device, "triangle pool", pool.triangle_capacity_ * triangle_bytes, false);
  if (!triangles) return triangles.error();
  pool.triangles_ = std::move(triangles).value();
  auto geometries = device.create_buffer({.name = "geometry table",
                                          .size_bytes = max_geometries * sizeof(shared::GeometryRecord),
                                          .memory = gpu::Memory::upload,
                                          .texel_uint4 = true});
  if (!geometries) return geometries.error();
  pool.geometries_ = std::move(geometries).value();
  return pool;
}

Result<void> GeometryPool::reserve(gpu::Device& device, const PoolPart& part, Submit& submit) {
  const std::uint32_t nodes = part.node_end;
  const std::uint32_t triangles = part.triangle_end;
  // Check both pools before either grows: a pool that exceeds the limits of a binding would make every later
  // call fail. The pools are read as texels and written by address and by copies.
  const gpu::DeviceLimits& limits = device.limits();
  const std::size_t largest_bytes = std::min(limits.max_allocation_bytes, 16 * limits.max_texel_elements);
  const std::size_t max_nodes = largest_bytes / node_bytes;
  const std::size_t max_triangles = largest_bytes / triangle_bytes;
  const auto refusal = [](const char* what, std::size_t wanted, std::size_t most) {
    return Error{ErrorCode::capacity, "all geometry together would need " + std::to_string(wanted) + " " +
                                          what + " in one buffer, and the device binds at most " +
                                          std::to_string(most)};
  };
  if (nodes > max_nodes) return refusal("nodes", nodes, max_nodes);
  if (triangles > max_triangles) return refusal("triangles", triangles, max_triangles);
  const auto grow = [&](gpu::Buffer& buffer, const char* name, std::uint32_t used, std::uint32_t wanted,
                        std::uint32_t& capacity, std::size_t most, std::size_t element_bytes,
                        bool holds_nodes) -> Result<void> {
    if (wanted <= capacity) return {};
    // Doubling keeps the number of copies low. Where the device does not allow it, the needed size will do.
    const std::size_t generous = std::max<std::size_t>(wanted, 2 * std::size_t{capacity});
    const auto target = static_cast<std::uint32_t>(std::min(generous, most));
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
  if (auto done = grow(nodes_, "node pool", node_count_, nodes, node_capacity_, max_nodes, node_bytes, true);
      !done)
    return done;
  return grow(triangles_, "triangle pool", triangle_count_, triangles, triangle_capacity_, max_triangles,
              triangle_bytes, false);
}

Result<void> GeometryPool::check_room(std::uint32_t triangles) const {
  if (count_ == max_geometries_) {
    return Error{ErrorCode::capacity,
                 "the database was opened for " + std::to_string(max_geometries_) + " geometries"};
  }
  if (std::size_t{triangle_count_} + triangles > max_triangles_total) {
    return Error{ErrorCode::capacity, "a geometry of " + std::to_string(triangles) + " triangles on top of " +
                                          std::to_string(triangle_count_) + " exceeds the limit of " +
                                          std::to_string(max_triangles_total)};
  }
  return {};
}

Result<std::uint32_t> GeometryPool::add(gpu::Device& device, std::shared_ptr<const TriangleMesh> mesh,
                                        Submit& submit, const GeometryOptions& options) {
  bounds_.reserve(count_ + 1);
  kept_.reserve(count_ + 1);
  const std::uint32_t generation = generation_;
  auto added =
      options.deforms ? add_deforming(device, *mesh, options, submit) : add_still(device, *mesh, submit);
  std::shared_ptr<const KeptGeometry> kept;
  if (added) {
    auto taken = keep(device, std::move(mesh), options, added.value(), submit);
    if (taken)
      kept = std::move(taken).value();
    else
      added = taken.error();
  }
  builder_.release(device);
  // Also after an error, since a pool may have grown before it.
  if (generation != generation_) {
    if (auto bound = bind_deforming(device); !bound) added = bound.error();
  }
  if (!added) {
    bounds_.resize(count_);
    std::erase_if(deforming_,
                  [&](const DeformingGeometry& geometry) { return geometry.id().index == count_; });
    return added.error();
  }
  node_count_ = added.value().node_end;
  triangle_count_ = added.value().triangle_end;
  kept_.push_back(std::move(kept));
  return count_++;
}

Result<PoolPart> GeometryPool::add_still(gpu::Device& device, const TriangleMesh& mesh, Submit& submit) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  if (auto room = check_room(count); !room) return room.error();
  if (auto started = builder_.start_build(device, mesh, submit); !started) return started.error();
  const Extents extents = extents_of(mesh);
  const bool closed = is_closed(mesh);
  const auto node_count = builder_.finish_build(submit);
  if (!node_count) return node_count.error();
  const PoolPart part{node_count_, node_count_ + node_count.value(), triangle_count_,
                      triangle_count_ + count};
  if (auto reserved = reserve(device, part, submit); !reserved) return reserved.error();
  if (!builder_.write({part.node_base, part.triangle_base}, nodes_, triangles_, submit))
    return Error{ErrorCode::device_lost, "the GPU stopped answering while a geometry was written"};
  bounds_.push_back({});
  write_record(count_, extents, part.node_base, closed);
  return part;
}

void GeometryPool::write_record(std::uint32_t geometry, const Extents& extents, std::uint32_t root,
                                bool closed) {
  const Bounds& bounds = extents.bounds;
  geometries_.host_as<shared::GeometryRecord>()[geometry] = {
      .box_center_m = 0.5f * (bounds.minimum_m + bounds.maximum_m),
      .root = root,
      .box_half_m = 0.5f * (bounds.maximum_m - bounds.minimum_m),
      .closed = closed ? 1u : 0u,
      .edges_yz_m = extents.edges[0],
      .edges_xz_m = extents.edges[1],
      .edges_xy_m = extents.edges[2],
      .corners_plus_x_m = extents.corners[0],
      .corners_minus_x_m = extents.corners[1]};
  bounds_[geometry] = bounds;
}

}  // namespace rtstdb::accel
