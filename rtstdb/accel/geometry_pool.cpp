#include "rtstdb/accel/geometry_pool.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/accel/transfer.hpp"
#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/geometry/solid_hull.hpp"
#include "rtstdb/splitmix64.hpp"
#include "shaders/shared/corner.h"
#include "shaders/shared/field.h"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr std::size_t node_bytes = 16 * shared::node_texels;
constexpr std::size_t triangle_bytes = 16 * shared::triangle_texels;

const Error lost_while_writing{ErrorCode::device_lost,
                               "the GPU stopped answering while a geometry was written"};

Result<gpu::Buffer> make_pool(gpu::Device& device, const char* name, std::size_t size_bytes,
                              bool holds_nodes) {
  gpu::BufferOptions options{.name = name, .size_bytes = size_bytes};
  options.texel_uint4 = true;
  options.texel_float4 = !holds_nodes;
  options.texel_image = true;
  options.addressed = true;
  return device.create_buffer(options);
}

constexpr std::uint32_t aligned(std::uint32_t count) {
  constexpr std::uint32_t step = DeformingGeometry::alignment;
  return (count + step - 1) / step * step;
}

}  // namespace

Result<GeometryPool> GeometryPool::create(gpu::Device& device, std::uint32_t max_geometries, Submit& submit) {
  return create_with_capacity(device, max_geometries, {}, submit);
}

Result<GeometryPool> GeometryPool::create_with_capacity(gpu::Device& device, std::uint32_t max_geometries,
                                                        const KeptGeometries& kept, Submit& submit) {
  const PoolPart used = kept.empty() ? PoolPart{} : kept.back()->part;
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
  if (auto reserved = pool.reserve_texels_of(device, kept, submit); !reserved) return reserved.error();
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

Result<void> GeometryPool::check_capacity(std::uint32_t triangles) const {
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
                                        Submit& submit, const GeometryOptions& options,
                                        std::shared_ptr<const ConvexParts> parts) {
  bounds_.reserve(count_ + 1);
  part_texels_.reserve(count_ + 1);
  attribute_texels_.resize(count_);
  attribute_texels_.push_back(shared::attributes_none);
  kept_.reserve(count_ + 1);
  const std::uint32_t generation = generation_;
  auto added = options.deforms ? add_deforming(device, *mesh, options, submit)
                               : add_still(device, *mesh, parts.get(), submit);
  std::shared_ptr<KeptGeometry> kept;
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
  std::vector<std::uint32_t> part_texels;
  if (added && parts) {
    auto written = add_hulls(device, *parts, submit);
    if (written)
      part_texels = std::move(written).value();
    else
      added = written.error();
  }
  if (added) {
    const auto written = add_attributes(device, *kept->mesh, options.deforms, submit);
    if (written) {
      set_attributes(count_, written.value());
    } else {
      if (!part_texels.empty()) hulls_.truncate(part_texels.front());
      added = written.error();
    }
  }
  if (!added) {
    attribute_texels_.resize(count_);
    bounds_.resize(count_);
    std::erase_if(deforming_,
                  [&](const DeformingGeometry& geometry) { return geometry.id().index == count_; });
    return added.error();
  }
  node_count_ = added.value().node_end;
  triangle_count_ = added.value().triangle_end;
  kept->parts = std::move(parts);
  kept_.push_back(std::move(kept));
  part_texels_.push_back(std::move(part_texels));
  return count_++;
}

Result<PoolPart> GeometryPool::add_still(gpu::Device& device, const TriangleMesh& mesh,
                                         const ConvexParts* parts, Submit& submit) {
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  if (auto checked = check_capacity(count); !checked) return checked.error();
  if (auto started = builder_.start_build(device, mesh, submit); !started) return started.error();
  const Extents extents =
      parts != nullptr ? extents_of(with_points_of_parts(mesh, *parts)) : extents_of(mesh);
  const bool closed = is_closed(mesh);
  const auto node_count = builder_.finish_build(submit);
  if (!node_count) return node_count.error();
  const PoolPart part{node_count_, node_count_ + node_count.value(), triangle_count_,
                      triangle_count_ + count};
  if (auto reserved = reserve(device, part, submit); !reserved) return reserved.error();
  if (!builder_.write({part.node_base, part.triangle_base}, nodes_, triangles_, submit))
    return lost_while_writing;
  bounds_.push_back({});
  write_record(count_, extents, {part.node_base, part.triangle_base}, count, closed);
  return part;
}

void GeometryPool::write_record(std::uint32_t geometry, const Extents& extents, const BlasBuilder::Place& at,
                                std::uint32_t triangles, bool closed) {
  const Bounds& bounds = extents.bounds;
  geometries_.host_as<shared::GeometryRecord>()[geometry] = {
      .box_center_m = 0.5f * (bounds.minimum_m + bounds.maximum_m),
      .root = at.node_base,
      .box_half_m = 0.5f * (bounds.maximum_m - bounds.minimum_m),
      .closed = closed ? 1u : 0u,
      .edges_yz_m = extents.edges[0],
      .edges_xz_m = extents.edges[1],
      .edges_xy_m = extents.edges[2],
      .corners_plus_x_m = extents.corners[0],
      .corners_minus_x_m = extents.corners[1],
      .field = shared::field_none,
      .first_triangle = at.leaf_base,
      .attributes = attribute_texels_[geometry],
      .triangles = triangles};
  bounds_[geometry] = bounds;
}

// ---- deforming geometry

Result<PoolPart> GeometryPool::add_deforming(gpu::Device& device, const TriangleMesh& mesh,
                                             const GeometryOptions& options, Submit& submit) {
  constexpr std::uint32_t places = DeformingGeometry::places;
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  const std::uint32_t alignment_loss = DeformingGeometry::alignment;
  if (auto checked = check_capacity((places * count) + (places + 1) * alignment_loss); !checked)
    return checked.error();
  deforming_.reserve(deforming_.size() + 1);
  refits_.reserve(deforming_.size() + 1);
  const DeformingGeometry::Capacity capacity = DeformingGeometry::capacity_for(count);
  const BlasBuilder::Place first{aligned(node_count_), aligned(triangle_count_)};
  const BlasBuilder::Place second{first.node_base + capacity.nodes, first.leaf_base + capacity.triangles};
  const PoolPart part{first.node_base, second.node_base + capacity.nodes, first.leaf_base,
                      second.leaf_base + capacity.triangles};
  auto made = DeformingGeometry::create(device, GeometryId{count_}, mesh, options, {first, second});
  if (!made) return made.error();
  DeformingGeometry geometry = std::move(made).value();
  const auto built = builder_.build(device, mesh, submit);
  if (!built) return built.error();
  if (auto reserved = reserve(device, part, submit); !reserved) return reserved.error();
  if (auto bound = geometry.bind(device, refit_passes_, nodes_, triangles_); !bound) return bound.error();
  geometry.upload(mesh.positions_m);
  // A refit computes the tree's cost and box. It also makes the driver compile the passes.
  for (std::size_t place = 0; place < places; ++place) {
    if (!builder_.write(geometry.at(place), nodes_, triangles_, submit) ||
        !builder_.write_order(geometry.order(place), submit))
      return lost_while_writing;
    geometry.adopt_tree(place, builder_.levels());
    submit.begin();
    geometry.record_refit(place, refit_passes_, submit.recorder());
    if (!submit.run()) return lost_while_writing;
    geometry.finish_refit(place, 0, ++refit_count_);
  }
  const DeformingGeometry::Shown shown = geometry.shown();
  bounds_.push_back({});
  write_record(count_, extents_of(shown.bounds), shown.at, count, shown.closed);
  deforming_.push_back(std::move(geometry));
  builder_.keep_capacity(mesh.triangles.size(), mesh.positions_m.size());
  return part;
}

Result<void> GeometryPool::bind_deforming(gpu::Device& device) {
  for (DeformingGeometry& geometry : deforming_) {
    if (auto bound = geometry.bind(device, refit_passes_, nodes_, triangles_); !bound) return bound;
  }
  return {};
}

bool GeometryPool::show(gpu::Device& device, const store::RowSource& rows, Submit& submit) {
  if (!is_whole()) return false;
  refits_.clear();
  for (std::size_t i = 0; i < deforming_.size(); ++i) {
    DeformingGeometry& geometry = deforming_[i];
    const store::Shape shape = rows.shape(geometry.id());
    if (geometry.find(shape.version) != DeformingGeometry::places) continue;
    if (refits_.empty()) submit.begin();
    refits_.push_back({i, geometry.evict_oldest(), shape.version});
    geometry.upload(shape.positions_m);
    geometry.record_refit(refits_.back().place, refit_passes_, submit.recorder());
  }
  if (!refits_.empty() && !submit.run()) return false;
  for (const Refit& refit : refits_) {
    DeformingGeometry& geometry = deforming_[refit.geometry];
    geometry.finish_refit(refit.place, refit.shape, ++refit_count_);
    ++counts_.refits;
    if (geometry.needs_rebuild(refit.place) && !build(device, geometry, refit, rows, submit)) return false;
  }
  // The sum of the mixed refit numbers identifies the set of shapes in their places.
  shown_ = fields_attached_ == 0 ? 0 : splitmix64_finalizer(~fields_attached_);
  for (const DeformingGeometry& geometry : deforming_) {
    const DeformingGeometry::Shown shown = geometry.shown();
    write_record(geometry.id().index, extents_of(shown.bounds), shown.at, triangles_of(geometry.id().index),
                 shown.closed);
    shown_ += splitmix64_finalizer(shown.refit_number);
  }
  return true;
}

bool GeometryPool::pin(const store::RowSource& rows) noexcept {
  const auto refusing = std::ranges::find_if(deforming_, [&](DeformingGeometry& geometry) {
    return !geometry.pin(rows.shape(geometry.id()).version);
  });
  for (auto pinned = deforming_.begin(); refusing != deforming_.end() && pinned != refusing; ++pinned)
    pinned->unpin(rows.shape(pinned->id()).version);
  return refusing == deforming_.end();
}

void GeometryPool::unpin(const store::RowSource& rows) noexcept {
  for (DeformingGeometry& geometry : deforming_)
    geometry.unpin(rows.shape(geometry.id()).version);
}

bool GeometryPool::build(gpu::Device& device, DeformingGeometry& geometry, const Refit& refit,
                         const store::RowSource& rows, Submit& submit) {
  const std::vector<glm::uvec3>& triangles = geometry.triangles();
  // Without kept memory the tree stays: allocating here is not allowed in the tick.
  if (!builder_.has_capacity_for(triangles.size(), geometry.position_count())) return true;
  const std::span positions_m = rows.shape(geometry.id()).positions_m;
  if (!builder_.build(device, {positions_m, triangles}, submit)) return false;
  if (!builder_.write(geometry.at(refit.place), nodes_, triangles_, submit) ||
      !builder_.write_order(geometry.order(refit.place), submit))
    return false;
  geometry.adopt_tree(refit.place, builder_.levels());
  submit.begin();
  geometry.record_refit(refit.place, refit_passes_, submit.recorder());
  if (!submit.run()) return false;
  geometry.finish_refit(refit.place, refit.shape, ++refit_count_);
  ++counts_.builds;
  return true;
}

}  // namespace rtstdb::accel
