// The pool and what the host keeps of it: taken down when a geometry is added, brought to another device.

#include <algorithm>
#include <utility>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/transfer.hpp"
#include "shaders/shared/node.h"

namespace rtstdb::accel {
namespace {

constexpr std::size_t node_bytes = 16 * shared::node_texels;
constexpr std::size_t triangle_bytes = 16 * shared::triangle_texels;

const Error lost{ErrorCode::device_lost, "the GPU stopped answering while geometry was brought back to it"};

std::size_t kept_bytes(const KeptGeometries& kept) {
  std::size_t bytes = 0;
  for (const auto& geometry : kept) {
    for (const auto* pieces : {&geometry->nodes, &geometry->triangles}) {
      for (const KeptGeometry::Piece& piece : *pieces)
        bytes += piece.bytes.size();
    }
    if (geometry->deforming) bytes += 2 * geometry->deforming->order.size();
  }
  return bytes;
}

}  // namespace

Result<std::shared_ptr<const KeptGeometry>> GeometryPool::keep(gpu::Device& device, const TriangleMesh& mesh,
                                                               const GeometryOptions& options,
                                                               const PoolPart& part, Submit& submit) {
  auto kept = std::make_shared<KeptGeometry>();
  kept->part = part;
  kept->record = geometries_.host_as<const shared::GeometryRecord>()[count_];
  kept->bounds = bounds_[count_];
  Result<void> read;
  const auto take = [&](std::vector<KeptGeometry::Piece>& pieces, const gpu::Buffer& pool, std::uint32_t base,
                        std::size_t count, std::size_t element_bytes) {
    if (!read) return;
    auto bytes = read_back(device, pool, base * element_bytes, count * element_bytes, submit);
    if (bytes)
      pieces.push_back({base, std::move(bytes).value()});
    else
      read = bytes.error();
  };
  if (!options.deforms) {
    take(kept->nodes, nodes_, part.node_base, part.node_end - part.node_base, node_bytes);
    take(kept->triangles, triangles_, part.triangle_base, part.triangle_end - part.triangle_base,
         triangle_bytes);
  } else {
    const DeformingGeometry& geometry = deforming_.back();
    const std::span<const std::uint32_t> levels = builder_.levels();
    KeptDeforming& deforming = kept->deforming.emplace();
    deforming = {.mesh = mesh,
                 .options = options,
                 .places = {geometry.at(0), geometry.at(1)},
                 .order = {},
                 .levels = {levels.begin(), levels.end()},
                 .built_burden = geometry.built_burden(0)};
    for (const BlasBuilder::Place& place : deforming.places)
      take(kept->nodes, nodes_, place.node_base, levels.back(), node_bytes);
    if (read) {
      auto order = read_back(device, geometry.order(0), 0, 16 * mesh.triangles.size(), submit);
      if (!order) return order.error();
      deforming.order = std::move(order).value();
    }
  }
  if (!read) return read.error();
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
  for (const KeptGeometry::Piece& piece : kept.triangles)
    there = there && upload.put(triangles_, piece.base * triangle_bytes, piece.bytes);
  if (!there) return lost;
  geometries_.host_as<shared::GeometryRecord>()[index] = kept.record;
  bounds_[index] = kept.bounds;
  if (!kept.deforming) return {};
  const KeptDeforming& deforming = *kept.deforming;
  auto made = DeformingGeometry::create(device, GeometryId{index}, deforming.mesh, deforming.options,
                                        deforming.places);
  if (!made) return made.error();
  DeformingGeometry& geometry = deforming_.emplace_back(std::move(made).value());
  for (std::size_t place = 0; place < DeformingGeometry::places; ++place) {
    if (!upload.put(geometry.order(place), 0, deforming.order)) return lost;
    geometry.adopt_tree(place, deforming.levels, deforming.built_burden);
  }
  placings_.reserve(deforming_.size());
  builder_.keep_room_for(deforming.mesh.triangles.size(), deforming.mesh.positions_m.size());
  return {};
}

}  // namespace rtstdb::accel
