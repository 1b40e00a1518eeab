// Copies of geometries on the host, and restoring them on another device.

#include <algorithm>
#include <array>
#include <utility>

#include "rtstdb/accel/corner_texels.hpp"
#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/hull_texels.hpp"
#include "rtstdb/accel/transfer.hpp"
#include "rtstdb/geometry/has_area.hpp"
#include "shaders/shared/contact.h"
#include "shaders/shared/corner.h"
#include "shaders/shared/field.h"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr std::size_t node_bytes = 16 * shared::node_texels;
constexpr std::size_t triangle_bytes = 16 * shared::triangle_texels;

const Error lost_while_restoring{ErrorCode::device_lost,
                                 "the GPU stopped answering while geometry was restored on it"};

std::uint64_t attribute_texels_of(const KeptGeometry& kept) {
  return corner_texel_count(*kept.mesh, !kept.deforming);
}

std::size_t kept_bytes(const KeptGeometries& kept) {
  std::size_t bytes = 0;
  for (const auto& geometry : kept) {
    for (const KeptGeometry::Piece& piece : geometry->nodes)
      bytes += piece.bytes.size();
    if (geometry->deforming)
      bytes += 2 * geometry->deforming->order.size();
    else
      bytes += triangle_bytes * geometry->mesh->triangles.size();
    if (geometry->field) bytes += geometry->field->report.bytes;
    bytes += TexelPool::texel_bytes * attribute_texels_of(*geometry);
  }
  return bytes;
}

std::uint32_t field_texels_of(const KeptGeometries& kept) {
  std::uint64_t bytes = 0;
  for (const auto& geometry : kept)
    bytes += geometry->field ? geometry->field->report.bytes : 0;
  return static_cast<std::uint32_t>(bytes / 16);
}

std::uint64_t hull_texels_of(const KeptGeometries& kept) {
  std::uint64_t texels = 0;
  for (const auto& geometry : kept)
    for (std::size_t i = 0; geometry->parts && i < geometry->parts->size(); ++i)
      texels += hull_texels((*geometry->parts)[i]).size();
  return texels;
}

/// Writes triangles in the builder's format, in pieces. False: the device is lost.
bool put_triangles(const TriangleMesh& mesh, std::span<const std::uint32_t> leaf_order,
                   const gpu::Buffer& pool, std::size_t offset_bytes, Upload& upload) {
  constexpr std::size_t max_at_once = 1024;
  std::array<glm::uvec4, shared::triangle_texels * max_at_once> texels;
  while (!leaf_order.empty()) {
    const std::size_t count = std::min(leaf_order.size(), max_at_once);
    auto texel = texels.begin();
    for (const std::uint32_t number : leaf_order.first(count)) {
      const glm::uvec3& corners = mesh.triangles[number];
      const glm::vec3& a = mesh.positions_m[corners.x];
      const glm::vec3& b = mesh.positions_m[corners.y];
      const glm::vec3& c = mesh.positions_m[corners.z];
      *texel++ = {glm::floatBitsToUint(a), number};
      *texel++ = {glm::floatBitsToUint(b), has_area(a, b, c) ? 0u : shared::triangle_without_area};
      *texel++ = {glm::floatBitsToUint(c), 0u};
    }
    const auto bytes = std::as_bytes(std::span(texels).first(shared::triangle_texels * count));
    if (!upload.put(pool, offset_bytes, bytes)) return false;
    offset_bytes += bytes.size();
    leaf_order = leaf_order.subspan(count);
  }
  return true;
}

}  // namespace

Result<void> GeometryPool::reserve_texels_of(gpu::Device& device, const KeptGeometries& kept,
                                             Submit& submit) {
  const std::uint64_t fields = std::max<std::uint64_t>(field_texels_of(kept), shared::field_header_texels);
  if (auto reserved = reserve_field_texels(device, fields, submit); !reserved) return reserved;
  const std::uint64_t hulls = std::max<std::uint64_t>(hull_texels_of(kept), shared::hull_header_texels);
  if (auto reserved = reserve_hull_texels(device, hulls, submit); !reserved) return reserved;
  std::uint64_t attributes = shared::corner_texels;
  for (const auto& geometry : kept)
    attributes += attribute_texels_of(*geometry);
  return reserve_attribute_texels(device, attributes, submit);
}

Result<std::shared_ptr<KeptGeometry>> GeometryPool::keep(gpu::Device& device,
                                                         std::shared_ptr<const TriangleMesh> mesh,
                                                         const GeometryOptions& options, const PoolPart& part,
                                                         Submit& submit) {
  auto kept = std::make_shared<KeptGeometry>();
  kept->part = part;
  kept->record = geometries_.host_as<const shared::GeometryRecord>()[count_];
  kept->bounds = bounds_[count_];
  const auto take_nodes = [&](std::uint32_t base, std::uint32_t count) {
    KeptGeometry::Piece& piece =
        kept->nodes.emplace_back(KeptGeometry::Piece{base, std::vector<std::byte>(count * node_bytes)});
    return read_back(device, {&nodes_, base * node_bytes, piece.bytes.size()}, piece.bytes, submit);
  };
  if (!options.deforms) {
    if (auto taken = take_nodes(part.node_base, part.node_end - part.node_base); !taken) return taken.error();
    kept->leaf_order.resize(mesh->triangles.size());
    const auto order = std::as_writable_bytes(std::span(kept->leaf_order));
    if (auto read = read_back(device, builder_.leaf_order(), order, submit); !read) return read.error();
  } else {
    const DeformingGeometry& geometry = deforming_.back();
    const std::span<const std::uint32_t> levels = builder_.levels();
    KeptDeforming& deforming = kept->deforming.emplace();
    deforming = {.options = options,
                 .places = {geometry.at(0), geometry.at(1)},
                 .order = {},
                 .levels = {levels.begin(), levels.end()},
                 .built_cost_ratio = geometry.built_cost_ratio(0)};
    for (const BlasBuilder::Place& place : deforming.places) {
      if (auto taken = take_nodes(place.node_base, levels.back()); !taken) return taken.error();
    }
    deforming.order.resize(16 * mesh->triangles.size());
    const gpu::BufferPart order{&geometry.order(0), 0, deforming.order.size()};
    if (auto read = read_back(device, order, deforming.order, submit); !read) return read.error();
  }
  kept->mesh = std::move(mesh);
  return kept;
}

Result<GeometryPool> GeometryPool::create_restored(gpu::Device& device, std::uint32_t max_geometries,
                                                   const KeptGeometries& kept, Submit& submit) {
  const PoolPart used = kept.empty() ? PoolPart{} : kept.back()->part;
  auto made = create_with_capacity(device, max_geometries, kept, submit);
  if (!made) return made.error();
  GeometryPool pool = std::move(made).value();
  pool.kept_ = kept;
  pool.count_ = static_cast<std::uint32_t>(kept.size());
  pool.node_count_ = used.node_end;
  pool.triangle_count_ = used.triangle_end;
  pool.bounds_.resize(kept.size());
  pool.part_texels_.resize(kept.size());
  pool.attribute_texels_.resize(kept.size(), shared::attributes_none);
  auto upload = Upload::create(device, kept_bytes(kept), submit);
  if (!upload) return upload.error();
  for (std::uint32_t index = 0; index < pool.count_; ++index) {
    const KeptGeometry& geometry = *kept[index];
    if (auto brought = pool.restore(device, index, geometry, upload.value()); !brought)
      return brought.error();
  }
  if (!upload.value().finish()) return lost_while_restoring;
  if (!pool.deforming_.empty()) {
    if (auto kept_memory = pool.builder_.allocate_kept(device); !kept_memory) return kept_memory.error();
  }
  if (auto bound = pool.bind_deforming(device); !bound) return bound.error();
  return pool;
}

Result<void> GeometryPool::restore(gpu::Device& device, std::uint32_t index, const KeptGeometry& kept,
                                   Upload& upload) {
  bool there = true;
  for (const KeptGeometry::Piece& piece : kept.nodes)
    there = there && upload.put(nodes_, piece.base * node_bytes, piece.bytes);
  there = there && put_triangles(*kept.mesh, kept.leaf_order, triangles_,
                                 kept.part.triangle_base * triangle_bytes, upload);
  if (!there) return lost_while_restoring;
  geometries_.host_as<shared::GeometryRecord>()[index] = kept.record;
  bounds_[index] = kept.bounds;
  if (kept.field && !restore_field(index, *kept.field, upload)) return lost_while_restoring;
  if (kept.parts && !restore_hulls(index, *kept.parts, upload)) return lost_while_restoring;
  if (!restore_attributes(index, kept, upload)) return lost_while_restoring;
  if (!kept.deforming) return {};
  const KeptDeforming& deforming = *kept.deforming;
  auto made =
      DeformingGeometry::create(device, GeometryId{index}, *kept.mesh, deforming.options, deforming.places);
  if (!made) return made.error();
  DeformingGeometry& geometry = deforming_.emplace_back(std::move(made).value());
  for (std::size_t place = 0; place < DeformingGeometry::places; ++place) {
    if (!upload.put(geometry.order(place), 0, deforming.order)) return lost_while_restoring;
    geometry.adopt_tree(place, deforming.levels, deforming.built_cost_ratio);
  }
  refits_.reserve(deforming_.size());
  builder_.keep_capacity(kept.mesh->triangles.size(), kept.mesh->positions_m.size());
  return {};
}

}  // namespace rtstdb::accel
