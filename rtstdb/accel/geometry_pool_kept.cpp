// The part of the pool that keeps geometry on the host and restores it on another device.

#include <glm/common.hpp>

#include <algorithm>
#include <array>
#include <utility>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/transfer.hpp"
#include "rtstdb/geometry/has_area.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr std::size_t node_bytes = 16 * shared::node_texels;
constexpr std::size_t triangle_bytes = 16 * shared::triangle_texels;

const Error lost{ErrorCode::device_lost, "the GPU stopped answering while geometry was brought back to it"};

std::size_t kept_bytes(const KeptGeometries& kept) {
  std::size_t bytes = 0;
  for (const auto& geometry : kept) {
    for (const KeptGeometry::Piece& piece : geometry->nodes)
      bytes += piece.bytes.size();
    if (geometry->deforming)
      bytes += 2 * geometry->deforming->order.size();
    else
      bytes += triangle_bytes * geometry->mesh->triangles.size();
  }
  return bytes;
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

Result<std::shared_ptr<const KeptGeometry>> GeometryPool::keep(gpu::Device& device,
                                                               std::shared_ptr<const TriangleMesh> mesh,
                                                               const GeometryOptions& options,
                                                               const PoolPart& part, Submit& submit) {
  auto kept = std::make_shared<KeptGeometry>();
  kept->part = part;
  kept->record = geometries_.host_as<const shared::GeometryRecord>()[count_];
  kept->bounds = bounds_[count_];
  const auto take_nodes = [&](std::uint32_t base, std::uint32_t count) {
    KeptGeometry::Piece& piece = kept->nodes.emplace_back(base, std::vector<std::byte>(count * node_bytes));
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
                 .built_burden = geometry.built_burden(0)};
    for (const BlasBuilder::Place& place : deforming.places) {
      if (auto taken = take_nodes(place.node_base, levels.back()); !taken) return taken.error();
    }
    deforming.order.resize(16 * mesh->triangles.size());
    const gpu::BufferPart order{&geometry.order(0), 0, deforming.order.size()};
    if (auto read = read_back(device, order, deforming.order, submit); !read) return read.error();
  }
  kept->mesh = std::move(mesh);
  return std::shared_ptr<const KeptGeometry>(std::move(kept));
}

Result<GeometryPool> GeometryPool::create_again(gpu::Device& device, std::uint32_t max_geometries,
                                                const KeptGeometries& kept, Submit& submit) {
  const PoolPart used = kept.empty() ? PoolPart{} : kept.back()->part;
  auto made = create_with_room(device, max_geometries, used, submit);
  if (!made) return made.error();
  GeometryPool pool = std::move(made).value();
  pool.kept_ = kept;
  pool.count_ = static_cast<std::uint32_t>(kept.size());
  pool.node_count_ = used.node_end;
  pool.triangle_count_ = used.triangle_end;
  pool.bounds_.resize(kept.size());
  auto upload = Upload::create(device, kept_bytes(kept), submit);
  if (!upload) return upload.error();
  for (std::uint32_t index = 0; index < pool.count_; ++index) {
    const KeptGeometry& geometry = *kept[index];
    if (auto brought = pool.bring_back(device, index, geometry, upload.value()); !brought)
      return brought.error();
  }
  if (!upload.value().finish()) return lost;
  if (!pool.deforming_.empty()) {
    if (auto room = pool.builder_.take_kept_room(device); !room) return room.error();
  }
  if (auto bound = pool.bind_deforming(device); !bound) return bound.error();
  return pool;
}

Result<void> GeometryPool::bring_back(gpu::Device& device, std::uint32_t index, const KeptGeometry& kept,
                                      Upload& upload) {
  bool there = true;
  for (const KeptGeometry::Piece& piece : kept.nodes)
    there = there && upload.put(nodes_, piece.base * node_bytes, piece.bytes);
  there = there && put_triangles(*kept.mesh, kept.leaf_order, triangles_,
                                 kept.part.triangle_base * triangle_bytes, upload);
  if (!there) return lost;
  geometries_.host_as<shared::GeometryRecord>()[index] = kept.record;
  bounds_[index] = kept.bounds;
  if (!kept.deforming) return {};
  const KeptDeforming& deforming = *kept.deforming;
  auto made =
      DeformingGeometry::create(device, GeometryId{index}, *kept.mesh, deforming.options, deforming.places);
  if (!made) return made.error();
  DeformingGeometry& geometry = deforming_.emplace_back(std::move(made).value());
  for (std::size_t place = 0; place < DeformingGeometry::places; ++place) {
    if (!upload.put(geometry.order(place), 0, deforming.order)) return lost;
    geometry.adopt_tree(place, deforming.levels, deforming.built_burden);
  }
  placings_.reserve(deforming_.size());
  builder_.keep_room_for(kept.mesh->triangles.size(), kept.mesh->positions_m.size());
  return {};
}

}  // namespace rtstdb::accel
